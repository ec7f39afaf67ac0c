#include "steps/spring_forces.hpp"

#include <cmath>

#include "common/dual.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

Spring spring_of(const PartNumbers& p, int spring) {
  return {p.spring_stiffness[spring], p.spring_rest_length[spring], p.spring_damping[spring]};
}

/// Vector from the first node of a spring to its second, in the axes of the unknowns, of positions or of velocities.
Vec3d between(const Model& model, const VectorX& q, int spring) {
  const auto& [first, second] = model.description.springs[at(spring)].nodes;
  const double *a = &q[model.node_dof[at(first)]], *b = &q[model.node_dof[at(second)]];
  return {b[0] - a[0], b[1] - a[1], model.planar() ? 0.0 : b[2] - a[2]};
}

double length_of(const Vec3d& d) { return std::sqrt(dot(d, d)); }

SpringStart<double> start_of(const StepProblem& problem, int spring) {
  return {.rule = problem.conserves_energy() ? SpringRule::mean
                  : problem.in_middle()      ? SpringRule::middle
                                             : SpringRule::end,
          .d = between(problem.model, problem.start->q, spring),
          .rate = problem.resists() ? 1.0 / problem.duration() : 0.0};
}

Vec3d pull(const SpringForce<double>& force) { return force.tension * force.direction; }

}  // namespace

SpringForces::SpringForces(const Model& model) {
  std::vector<int> dofs;
  for (const SpringDescription& spring : model.description.springs)
    for (int node : spring.nodes)
      for (int i = 0; i < model.dimension; ++i) dofs.push_back(model.node_dof[at(node)] + i);
  table_ = ElementTable(2 * model.dimension, std::move(dofs));
}

bool SpringForces::dissipates(const Parameters& parameters) const {
  return (parameters.spring_damping.array() > 0.0).any();
}

std::string SpringForces::note() const {
  return std::to_string(table_.count()) + " spring(s): the matrix couples the nodes of each";
}

void SpringForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                       std::span<double> values) const {
  const int n = problem.model.dimension;
  const bool symmetric = assembler.solver().symmetry() == Symmetry::symmetric;
  Local local;
  for (int s = 0; s < table_.count(); ++s) {
    const Spring spring = spring_of(*problem.parameters, s);
    const Vec3d d = between(problem.model, data.z, s);
    const SpringForce<double> force = spring_force(spring, start_of(problem, s), d);
    const Vec3d f = pull(force);
    const Mat3<double>& K = force.derivative;
    for (int i = 0; i < n; ++i) {
      local.gradient[i] = -f[i];
      local.gradient[n + i] = f[i];
      for (int j = 0; j < n; ++j) {
        // Symmetric matrices contain only the symmetric part. It omits the lag of the direction of a damper behind its
        // length.
        const double entry = symmetric ? 0.5 * (K.row[i][j] + K.row[j][i]) : K.row[i][j];
        local.hessian[i][j] = local.hessian[n + i][n + j] = entry;
        local.hessian[i][n + j] = local.hessian[n + i][j] = -entry;
      }
    }
    add_element(table_, s, local, data, values);
    data.potential += spring_energy(spring, length_of(d));
  }
}

void SpringForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&,
                               StepAdjoint& adjoint) const {
  using ByStart = Dual<3>;
  const int n = problem.model.dimension;
  double rows[kMaxLocal];
  for (int s = 0; s < table_.count(); ++s) {
    gather(table_, s, adjoint.rows, rows);
    Vec3d apart{rows[n] - rows[0], rows[n + 1] - rows[1], n == 3 ? rows[5] - rows[2] : 0.0};
    const Spring spring = spring_of(*problem.parameters, s);
    const Vec3d d = between(problem.model, data.z, s);
    const SpringStart<double> start = start_of(problem, s);
    const auto along = [&](const Spring& of) { return dot(apart, pull(spring_force(of, start, d))); };
    const double unit = along({1.0, spring.rest_length, 0.0});
    CoefficientAdjoint& by = adjoint.coefficients;
    by.spring_stiffness[s] += unit;
    by.spring_rest_length[s] += spring.stiffness * (along({1.0, spring.rest_length + 1.0, 0.0}) - unit);
    by.spring_damping[s] += along({0.0, 0.0, 1.0});
    if (start.rule == SpringRule::end && spring.damping == 0.0) continue;
    const Vec3<ByStart> d0{ByStart::unknown(start.d.x, 0), ByStart::unknown(start.d.y, 1),
                           ByStart::unknown(start.d.z, 2)};
    const SpringForce<ByStart> force =
        spring_force<ByStart>(spring, {.rule = start.rule, .d = d0, .rate = start.rate}, {d.x, d.y, d.z});
    const int* dofs = table_.dofs(s);
    for (int c = 0; c < n; ++c) {
      double slope = 0.0;
      for (int i = 0; i < n; ++i) slope += apart[i] * (force.tension * force.direction[i]).slope[c];
      adjoint.start[dofs[n + c]] += slope;
      adjoint.start[dofs[c]] -= slope;
    }
  }
}

/// Rounding errors of positions are eps |x|. They also affect lengths.
void SpringForces::add_rounding(const StepProblem& problem, StepData& data) const {
  const int n = problem.model.dimension;
  for (int s = 0; s < table_.count(); ++s) {
    const Spring spring = spring_of(*problem.parameters, s);
    const SpringStart<double> start = start_of(problem, s);
    const Vec3d w = spring_force(spring, start, between(problem.model, data.z, s)).direction;
    const double bound =
        kRounding * (spring.stiffness + 2.0 * spring.damping * start.rate) * (data.rounding.reach + spring.rest_length);
    const int* dofs = table_.dofs(s);
    for (int i = 0; i < 2 * n; ++i) data.floor[dofs[i]] += bound * std::abs(w[i % n]);
  }
}

double SpringForces::dissipated(const StepProblem& problem, const StepData& data, const Assembler&,
                                const VectorX& change) const {
  double work = 0.0;
  for (int s = 0; problem.moves() && s < table_.count(); ++s) {
    Spring damper = spring_of(*problem.parameters, s);
    damper.stiffness = 0.0;
    const Vec3d d = between(problem.model, data.z, s);
    work += dot(pull(spring_force(damper, start_of(problem, s), d)), between(problem.model, change, s));
  }
  return work;
}

double spring_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, int spring) {
  return spring_energy(spring_of(numbers, spring), length_of(between(model, q, spring)));
}

double spring_tension(const Model& model, const Parameters& parameters, const VectorX& q, const VectorX& v,
                      int spring) {
  const Spring own = spring_of(parameters, spring);
  const Vec3d d = between(model, q, spring);
  const double length = length_of(d);
  const double rate = length > 0.0 ? dot(d, between(model, v, spring)) / length : 0.0;
  return own.stiffness * (length - own.rest_length) + own.damping * rate;
}

}  // namespace withe
