#include "steps/loop_forces.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "steps/carried_parts.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

// Rate of a constraint that counts as zero, over the greatest one. Points of joints are drawn to 1e-9 of the scene.
constexpr double kNegligibleRate = 1e-7;

/// Half of the skew part of a rotation: its vector, if it is small.
Vector3 small_turn(const Matrix3& R) { return 0.5 * Vector3(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)); }

/// Unknowns on which the places of carried parts depend, without carried ones.
std::vector<int> moving_unknowns(const Model& model, const std::vector<int>& of) {
  std::vector<int> carried_by(at(model.dof_count), -1);
  for (std::size_t i = 0; i < model.carried.size(); ++i)
    std::fill_n(carried_by.begin() + model.carried[i].own_dof, model.carried[i].own_size, static_cast<int>(i));
  std::set<int> seen(of.begin(), of.end());
  std::vector<int> pending = of, found;
  while (!pending.empty()) {
    const int dof = pending.back();
    pending.pop_back();
    if (carried_by[at(dof)] < 0) {
      found.push_back(dof);
      continue;
    }
    for (int next : model.carried[at(carried_by[at(dof)])].body_dofs)
      if (seen.insert(next).second) pending.push_back(next);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

LoopForces::LoopForces(const Model& model) {
  std::vector<int> dofs;
  const auto add = [&](int first, int size) {
    for (int i = 0; i < size; ++i) dofs.push_back(first + i);
  };
  for (const Loop& loop : model.loops) {
    add(model.node_dof[at(loop.copy_node)], model.dimension);
    add(model.node_dof[at(loop.body_node)], model.dimension);
    add(model.frame_dof[at(loop.copy_frame)], model.frame_size());
    add(model.frame_dof[at(loop.body_frame)], model.frame_size());
    add(loop.dof, model.loop_size());
  }
  table_ = ElementTable(3 * model.loop_size(), std::move(dofs));
  closures_.resize(model.loops.size());
  stiffness_.assign(model.loops.size(), 1.0);
  turning_stiffness_ = stiffness_;
  find_closures(model);
}

/// The rates of all constraints by the unknowns of the tree, where the scene is drawn.
void LoopForces::find_closures(const Model& model) {
  const State drawn = initial_state(model);
  StepProblem problem(model);
  problem.start = &drawn;
  const int n = model.dimension, turns = model.frame_size(), size = model.loop_size();
  std::vector<int> of;
  for (int e = 0; e < table_.count(); ++e) of.insert(of.end(), table_.dofs(e), table_.dofs(e) + 2 * size);
  const std::vector<int> unknowns = moving_unknowns(model, of);
  std::vector<bool> is_length(at(model.dof_count), false);
  for (int dof : model.node_dof) std::fill_n(is_length.begin() + dof, n, true);
  for (const Slide& slide : model.slides) is_length[at(slide.dof)] = true;
  // Projected onto the directions that supports leave free.
  MatrixX rates = MatrixX::Zero(size * table_.count(), static_cast<Eigen::Index>(unknowns.size()));
  VectorX step(model.dof_count);
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    step.setZero();
    step[unknowns[k]] = is_length[at(unknowns[k])] ? model.length_scale : 1.0;
    for (const Constraint& c : model.constraints) step.segment(c.first, c.size) = (c.free * c.part(step)).head(c.size);
    expand_step(problem, drawn.q, step);
    for (int e = 0; e < table_.count(); ++e) {
      const int* d = table_.dofs(e);
      for (int i = 0; i < n; ++i) rates(e * size + i, k) = (step[d[i]] - step[d[n + i]]) / model.length_scale;
      for (int i = 0; i < turns; ++i) rates(e * size + n + i, k) = step[d[2 * n + i]] - step[d[2 * n + turns + i]];
    }
  }
  const double least = kNegligibleRate * std::max(rates.cwiseAbs().maxCoeff(), 1e-300);
  for (int e = 0; e < table_.count(); ++e) {
    const auto principal = [&](int first, int count, Matrix3& axes) {
      auto block = rates.middleRows(e * size + first, count);
      const Eigen::JacobiSVD<MatrixX> svd(block, Eigen::ComputeFullU);
      if (svd.singularValues().size() == count && svd.singularValues()(count - 1) > least) return;
      axes.topLeftCorner(count, count) = svd.matrixU();
      block = (svd.matrixU().transpose() * block).eval();
    };
    principal(0, n, closures_[at(e)].axes);
    principal(n, turns, closures_[at(e)].turning_axes);
  }
  Eigen::ColPivHouseholderQR<MatrixX> independent(rates.transpose());
  independent.setThreshold(kNegligibleRate);
  for (Eigen::Index k = 0; k < independent.rank(); ++k) {
    const int row = independent.colsPermutation().indices()[k];
    closures_[at(row / size)].keeps[at(row % size)] = true;
  }
}

std::string LoopForces::note() const {
  int kept = 0;
  for (const Closure& closure : closures_)
    kept += static_cast<int>(std::count(closure.keeps.begin(), closure.keeps.end(), true));
  const int implied = static_cast<int>(closures_.size()) * table_.width() / 3 - kept;
  std::string text = std::to_string(closures_.size()) + " closed loop(s) of joints: " + std::to_string(kept) +
                     " multipliers, in an unsymmetric matrix";
  if (implied > 0) text += "; " + std::to_string(implied) + " constraints follow from the others";
  return text;
}

void LoopForces::begin(StepProblem& problem) {
  const Model& model = problem.model;
  const Parameters& p = *problem.parameters;
  const double length = model.length_scale;
  const double rate = problem.moves() ? 1.0 / (problem.interval * problem.interval) : 0.0;
  double rest = p.added_mass.sum() * p.gravity.norm() / length + p.spring_stiffness.sum() +
                p.joint_stiffness.sum() / (length * length);
  if (rest == 0.0 && rate == 0.0) rest = 1.0;
  for (std::size_t k = 0; k < model.loops.size(); ++k) {
    const Loop& loop = model.loops[k];
    stiffness_[k] = rest + rate * p.added_mass(loop.body_center);
    turning_stiffness_[k] = rest * length * length + rate * p.body_inertia[at(loop.body)].trace() / 3.0;
  }
}

std::array<double, LoopForces::kMost> LoopForces::gaps(const StepProblem& problem, const VectorX& z, std::size_t loop,
                                                       Matrix3& axes, Matrix3& turning_axes) const {
  const Model& model = problem.model;
  const Loop& of = model.loops[loop];
  const Closure& closure = closures_[loop];
  const int n = model.dimension, turns = model.frame_size();
  const int* d = table_.dofs(static_cast<int>(loop));
  const VectorX& q0 = problem.start->q;
  // The gap at the end of a midpoint step, 2 (z_C - z_B) - (q0_C - q0_B), over 2.
  const double before = 1.0 - 1.0 / problem.end_rate();
  Vector3 apart = Vector3::Zero(), turned = Vector3::Zero();
  for (int i = 0; i < n; ++i) apart[i] = z[d[i]] - z[d[n + i]] - before * (q0[d[i]] - q0[d[n + i]]);
  const int copy = 2 * n, body = 2 * n + turns;
  if (model.planar()) {
    turned[0] = z[d[copy]] - z[d[body]] - before * (q0[d[copy]] - q0[d[body]]);
    const double angle = q0[d[copy]], c = std::cos(angle), s = std::sin(angle);
    Matrix3 turn = Matrix3::Identity();
    turn.topLeftCorner<2, 2>() << c, -s, s, c;
    axes = turn * closure.axes;
    turning_axes = closure.turning_axes;
  } else {
    const Matrix3& frame = problem.start->frame[at(of.copy_frame)];
    const Vector3 off = small_turn(frame * problem.start->frame[at(of.body_frame)].transpose());
    for (int i = 0; i < 3; ++i) turned[i] = z[d[copy + i]] - z[d[body + i]];
    turned += off / problem.end_rate();
    axes = frame * closure.axes;
    turning_axes = frame * closure.turning_axes;
  }
  std::array<double, kMost> out{};
  for (int i = 0; i < n; ++i) out[at(i)] = axes.col(i).dot(apart);
  for (int i = 0; i < turns; ++i) out[at(n + i)] = turning_axes.col(i).dot(turned);
  return out;
}

void LoopForces::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double> values) const {
  const Model& model = problem.model;
  const int n = model.dimension, turns = model.frame_size(), size = model.loop_size();
  constexpr int kWidest = 3 * kMost;
  for (int e = 0; e < table_.count(); ++e) {
    const Closure& closure = closures_[at(e)];
    const int* d = table_.dofs(e);
    Matrix3 axes, turning_axes;
    const std::array<double, kMost> gap = gaps(problem, data.z, at(e), axes, turning_axes);
    double gradient[kWidest] = {}, hessian[kWidest][kWidest] = {};
    const auto hold = [&](int row, int first, int count, const Vector3& axis, double stiffness) {
      const int multiplier = 2 * size + row;
      if (!closure.keeps[at(row)]) {
        gradient[multiplier] = data.z[d[multiplier]];
        hessian[multiplier][multiplier] = 1.0;
        return;
      }
      const double force = data.z[d[multiplier]] + stiffness * gap[at(row)];
      gradient[multiplier] = stiffness * gap[at(row)];
      data.potential += data.z[d[multiplier]] * gap[at(row)] + 0.5 * stiffness * gap[at(row)] * gap[at(row)];
      for (int i = 0; i < count; ++i)
        for (int side : {0, 1}) {
          const double along = side == 0 ? axis[i] : -axis[i];
          const int own = first + side * count + i;
          gradient[own] += force * along;
          hessian[own][multiplier] = along;
          hessian[multiplier][own] = stiffness * along;
          for (int j = 0; j < count; ++j) {
            hessian[own][first + j] += stiffness * along * axis[j];
            hessian[own][first + count + j] -= stiffness * along * axis[j];
          }
        }
    };
    for (int i = 0; i < n; ++i) hold(i, 0, n, axes.col(i), stiffness_[at(e)]);
    for (int i = 0; i < turns; ++i) hold(n + i, 2 * n, turns, turning_axes.col(i), turning_stiffness_[at(e)]);
    for (int i = 0; i < 2 * size; ++i) {
      data.gradient[d[i]] += gradient[i];
      data.row_magnitude[d[i]] += std::abs(gradient[i]);
      if (problem.conserves_energy() && i >= 2 * n) data.elastic_rows[d[i]] += gradient[i];
    }
    for (int i = 2 * size; i < 3 * size; ++i) data.gradient[d[i]] += gradient[i];
    if (!values.empty()) table_.add_hessian(e, hessian, 1.0, values);
  }
}

/// Rounding errors of points and turns, as forces.
void LoopForces::add_rounding(const StepProblem& problem, StepData& data) const {
  const Model& model = problem.model;
  const int n = model.dimension, size = model.loop_size();
  for (int e = 0; e < table_.count(); ++e) {
    const int* d = table_.dofs(e);
    // Rows of nodes pass only a small share of their bound on to bodies, see `fold_bounds`.
    constexpr double kPassed = 16.0;
    const double force = kRounding * stiffness_[at(e)] * std::max(data.rounding.reach, 1e-300),
                 moment = kRounding * turning_stiffness_[at(e)];
    for (int i = 0; i < 2 * size; ++i) data.floor[d[i]] += kPassed * (i < 2 * n ? force : moment);
    for (int i = 0; i < size; ++i) data.floor[d[2 * size + i]] += i < n ? force : moment;
  }
}

void LoopForces::add_adjoint(const StepProblem&, const StepData&, const Assembler&, StepAdjoint&) const {
  throw std::invalid_argument("gradients through closed loops of joints are not available");
}

double LoopForces::greatest_violation(const StepProblem& problem, const VectorX& z) const {
  const Model& model = problem.model;
  double greatest = 0.0;
  for (std::size_t k = 0; k < closures_.size(); ++k) {
    Matrix3 axes, turning_axes;
    const std::array<double, kMost> gap = gaps(problem, z, k, axes, turning_axes);
    for (int i = 0; i < model.loop_size(); ++i)
      if (!closures_[k].keeps[at(i)])
        greatest = std::max(
            greatest, problem.end_rate() * std::abs(gap[at(i)]) * (i < model.dimension ? 1.0 : model.length_scale));
  }
  return greatest;
}

void LoopForces::condense(const Assembler& assembler, const LinearSolver& from, LinearSolver& symmetric) const {
  // Stiffness along a constraint, over that of the scene there. Its inverse, and its rounding error, are the shares of
  // the stiffness of the scene by which that of a motion is wrong: equal at the root of the inverse rounding error.
  constexpr double kStiff = 1e8;
  const SparsityPattern& pattern = assembler.pattern();
  const std::span<const double> a = from.values();
  const std::span<double> to = symmetric.values();
  const auto entry = [&](int row, int column) -> double& {
    return to[static_cast<std::size_t>(symmetric.place(std::max(row, column), std::min(row, column)))];
  };
  const int size = table_.width() / 3;
  std::vector<int> multipliers;
  for (int e = 0; e < table_.count(); ++e)
    multipliers.insert(multipliers.end(), table_.dofs(e) + 2 * size, table_.dofs(e) + 3 * size);
  const auto is_multiplier = [&](int dof) {
    return std::find(multipliers.begin(), multipliers.end(), dof) != multipliers.end();
  };
  std::vector<int> rows;
  for (int multiplier : multipliers) {
    rows.clear();
    double along = 0.0, square = 0.0;  // stiffness of the scene along the constraint
    const auto slope = [&](int row) { return a[static_cast<std::size_t>(from.place(row, multiplier))]; };
    for (int k = pattern.column_starts[at(multiplier)]; k < pattern.column_starts[at(multiplier) + 1]; ++k) {
      const int row = pattern.row_indices[at(k)];
      if (is_multiplier(row) || slope(row) == 0.0) continue;
      rows.push_back(row);
      square += slope(row) * slope(row);
      along += slope(row) * slope(row) * std::abs(assembler.diagonal(row));
    }
    const double stiff = kStiff * (along > 0.0 ? along / (square * square) : 1.0);
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) entry(rows[i], rows[j]) += stiff * slope(rows[i]) * slope(rows[j]);
  }
  for (int multiplier : multipliers)
    for (int k = pattern.column_starts[at(multiplier)]; k < pattern.column_starts[at(multiplier) + 1]; ++k) {
      const int row = pattern.row_indices[at(k)];
      entry(row, multiplier) = row == multiplier ? 1.0 : 0.0;
    }
}

}  // namespace withe
