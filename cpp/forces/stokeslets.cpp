#include "forces/stokeslets.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.hpp"
#include "common/text.hpp"

namespace withe {
namespace {

constexpr int kMostNodes = 128;  // greatest number of nodes whose mobility is factorised together
constexpr int kMostIterations = 1000;
constexpr double kTolerance = 1e-9;  // relative error of the velocity
constexpr int kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
constexpr double kRough = 0.03;  // relative tolerance of rough solutions
constexpr int kWait = 12;        // solutions until it is looked for again
// Shortest edge over the regularization: on shorter edges, forces that differ from node to node do not move the fluid.
constexpr double kFinest = 1.0 / 3.0;

std::size_t at(std::ptrdiff_t i) { return static_cast<std::size_t>(i); }

/// Modified Bessel function of the second kind, of order 0 or 1: the integral of exp(-x cosh t) cosh(order t) over
/// positive t. The error of the trapezoidal rule falls faster than any power of its step.
double bessel_k(int order, double x) {
  constexpr double kStep = 0.1;
  double sum = 0.5 * std::exp(-x);
  for (double t = kStep; t < 8.0; t += kStep) sum += std::exp(-x * std::cosh(t)) * std::cosh(order * t);
  return kStep * sum;
}

/// Resistance per length and viscosity, across a line, to waves of wavenumber 1 / regularization.
double smooth_resistance() { return 8.0 * std::numbers::pi / (2.0 * bessel_k(0, 1.0) + 2.0 * bessel_k(1, 1.0)); }

}  // namespace

double wave_resistance(double x) {
  const double k0 = bessel_k(0, x), k1 = bessel_k(1, x);
  return 8.0 * std::numbers::pi / std::min(4.0 * k0, 2.0 * (k0 + x * k1));
}

void StokesletFluid::set_local_drag(double viscosity, MassMatrix& drag) const {
  drag.rows.setZero(model_.dof_count);
  for (int i = 0; i < model_.node_count; ++i)
    drag.rows.segment(model_.node_dof[at(i)], model_.dimension).setConstant(viscosity * node_drag_[i]);
  drag.coupling = -viscosity * edge_drag_;
}

void check_regularization(const Model& model, double regularization) {
  require(regularization > 0.0, "regularization of the fluid must be positive, got " + text(regularization));
  const double shortest = model.edge_length.minCoeff();
  require(shortest >= kFinest * regularization,
          "regularization of the fluid must not exceed 3 edge lengths, or velocities "
          "would not determine forces, got " +
              text(regularization) + " m with edges of " + text(shortest) + " m");
}

void StokesletFluid::set_edge_drag() {
  // The shortest wave that edges can tell moves them less than a smooth one: the transform of the hats, and its images.
  constexpr double kHats = 8.0 / (std::numbers::pi * std::numbers::pi);
  const double across = smooth_resistance();
  edge_drag_.resize(model_.edge_count);
  for (int e = 0; e < model_.edge_count; ++e) {
    const double length = model_.edge_length[e];
    const double shortest = wave_resistance(std::numbers::pi * regularization() / length) / kHats;
    edge_drag_[e] = 0.25 * length * std::max(shortest - across, 0.0);
  }
}

void StokesletFluid::set_regularization(double regularization) {
  if (regularization == memory_.regularization) return;
  memory_.regularization = regularization;
  set_edge_drag();
  forget();
}

StokesletFluid::StokesletFluid(const Model& model)
    : model_(model), line_(line_length(model.node_count)), node_length_(VectorX::Zero(model.node_count)) {
  memory_.regularization = model.description.fluid.regularization;
  check_regularization(model, regularization());
  for (int e = 0; e < model.edge_count; ++e)
    for (int node : {model.edge_tail[at(e)], model.edge_head[at(e)]}) node_length_[node] += 0.5 * model.edge_length[e];
  inverse_length_ = node_length_.cwiseInverse();
  node_drag_ = smooth_resistance() * node_length_;
  set_edge_drag();
  std::vector<bool> taken(at(model.node_count), false);
  for (std::size_t r = 0; r + 1 < model.rod_first_edge.size(); ++r) {
    const int first = model.rod_first_edge[r], end = model.rod_first_edge[r + 1];
    std::vector<int> own;
    const auto add_slot = [&](int node, int edge) {
      slot_node_.push_back(node);
      segment_edge_.push_back(edge);
      if (!taken[at(node)]) own.push_back(node);
      taken[at(node)] = true;
    };
    for (int e = first; e < end; ++e) add_slot(model.edge_tail[at(e)], e);
    add_slot(model.edge_head[at(end - 1)], -1);
    const int parts = (static_cast<int>(own.size()) + kMostNodes - 1) / kMostNodes;
    for (int k = 0; k < parts; ++k) {
      const auto from = own.begin() + static_cast<std::ptrdiff_t>(own.size()) * k / parts;
      const auto to = own.begin() + static_cast<std::ptrdiff_t>(own.size()) * (k + 1) / parts;
      chunks_.emplace_back().nodes.assign(from, to);
    }
  }
  segments_ = line_length(static_cast<std::ptrdiff_t>(slot_node_.size()));
  for (VectorX* v : {&start_, &direction_}) v->setZero(3 * segments_);
  for (VectorX* v : {&length_, &inverse_segment_}) v->setZero(segments_);
  for (VectorX* v : {&of_start_, &of_end_}) v->setZero(kBlockEntries * segments_);
  std::ptrdiff_t size = 0;
  for (std::ptrdiff_t i = 0; i < model.node_count; ++i) {
    row_start_.push_back(size);
    size += kBlockEntries * line_length(i);
  }
  lower_.setZero(size);
  diagonal_.setZero(kBlockEntries * line_);
  for (VectorX* v : {&position_, &right_, &memory_.solution, &residual_, &scaled_, &search_, &image_, &memory_.past[0],
                     &memory_.past[1], &memory_.wave, &kept_})
    v->setZero(3 * line_);
  for (Chunk& chunk : chunks_) {
    const auto n = static_cast<Eigen::Index>(3 * chunk.nodes.size());
    chunk.factor.resize(n, n);
    chunk.part.resize(n);
  }
}

void StokesletFluid::forget() {
  memory_.known = 0;
  memory_.factorized_at.resize(0);
  memory_.waited = 0;
  memory_.excess = 1.0;
  memory_.wave.setZero();
}

void StokesletFluid::recall(const Memory& memory) {
  for (const VectorX* v : {&memory.solution, &memory.past[0], &memory.past[1], &memory.wave})
    require(v->size() == 3 * line_ && v->allFinite(), "memory of a fluid must be that of the same scene");
  require(memory.factorized_at.size() == 0 || memory.factorized_at.size() == model_.dof_count,
          "memory of a fluid must be that of the same scene");
  require(memory.known >= 0 && memory.known <= 3, "memory of a fluid must have up to three solutions");
  check_regularization(model_, memory.regularization);
  set_regularization(memory.regularization);
  if (memory.factorized_at.size() > 0) {
    place(memory.factorized_at);
    assemble();
    factorize(memory.factorized_at);
  }
  memory_ = memory;
}

double* StokesletFluid::row(int node, int entry) {
  return lower_.data() + row_start_[at(node)] + entry * line_length(node);
}

/// Segments between the nodes at q.
void StokesletFluid::place(const VectorX& q) {
  for (int i = 0; i < model_.node_count; ++i)
    for (int k = 0; k < model_.dimension; ++k) position_[k * line_ + i] = q[model_.node_dof[at(i)] + k];
  for (std::size_t s = 0; s < segment_edge_.size(); ++s) {
    const int edge = segment_edge_[s];
    if (edge < 0) continue;
    const int tail = model_.edge_tail[at(edge)], head = model_.edge_head[at(edge)];
    const auto to = static_cast<Eigen::Index>(s);
    Vector3 d;
    for (int k = 0; k < 3; ++k) d[k] = position_[k * line_ + head] - position_[k * line_ + tail];
    const double length = d.norm();
    length_[to] = length;
    inverse_segment_[to] = 1.0 / length;
    for (int k = 0; k < 3; ++k) {
      start_[k * segments_ + to] = position_[k * line_ + tail];
      direction_[k * segments_ + to] = d[k] / length;
    }
  }
}

/// Velocity of one node by unit forces on all nodes, half of it to each of the two places that a block has in B + B^T.
void StokesletFluid::add_row(int node) {
  const double x[3] = {position_[node], position_[line_ + node], position_[2 * line_ + node]};
  const auto column = [this](const VectorX& v, int k) { return v.data() + k * segments_; };
  const SegmentBatch batch{segments_,
                           {column(start_, 0), column(start_, 1), column(start_, 2)},
                           {column(direction_, 0), column(direction_, 1), column(direction_, 2)},
                           length_.data(),
                           inverse_segment_.data()};
  stokeslet_kernels().velocity(batch, x, regularization(), of_start_.data(), of_end_.data());
  const auto slots = static_cast<std::ptrdiff_t>(slot_node_.size());
  for (int k = 0; k < kBlockEntries; ++k) {
    double* own = row(node, k);
    const double *starts = column(of_start_, k), *ends = column(of_end_, k);
    for (std::ptrdiff_t s = 0; s < slots; ++s) {
      const int j = slot_node_[at(s)];
      const double value = (starts[s] + (s > 0 ? ends[s - 1] : 0.0)) * inverse_length_[j];
      if (j < node)
        own[j] += 0.5 * value;
      else if (j > node)
        row(j, k)[node] += 0.5 * value;
      else
        diagonal_[k * line_ + node] += value;
    }
  }
}

void StokesletFluid::assemble() {
  lower_.setZero();
  diagonal_.setZero();
  for (int i = 0; i < model_.node_count; ++i) add_row(i);
}

/// Parts of A at q, where it has been assembled.
bool StokesletFluid::factorize(const VectorX& q) {
  for (Chunk& chunk : chunks_) {
    const auto n = static_cast<int>(chunk.nodes.size());
    for (int b = 0; b < n; ++b)
      for (int a = b; a < n; ++a) {
        const int i = std::max(chunk.nodes[at(a)], chunk.nodes[at(b)]);
        const int j = std::min(chunk.nodes[at(a)], chunk.nodes[at(b)]);
        for (int k = 0; k < 3; ++k)
          for (int l = 0; l < 3; ++l)
            chunk.factor(3 * a + k, 3 * b + l) = i == j ? diagonal_[kEntry[k][l] * line_ + i] : row(i, kEntry[k][l])[j];
      }
    if (Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(chunk.factor).info() != Eigen::Success) return false;
  }
  memory_.factorized_at = q;
  return true;
}

/// Computes to = (factorised parts of A)^-1 from.
void StokesletFluid::precondition(const VectorX& from, VectorX& to) {
  for (Chunk& chunk : chunks_) {
    for (std::size_t a = 0; a < chunk.nodes.size(); ++a)
      for (int k = 0; k < 3; ++k) chunk.part[static_cast<Eigen::Index>(3 * a) + k] = from[k * line_ + chunk.nodes[a]];
    const auto lower = chunk.factor.triangularView<Eigen::Lower>();
    lower.solveInPlace(chunk.part);
    lower.adjoint().solveInPlace(chunk.part);
    for (std::size_t a = 0; a < chunk.nodes.size(); ++a)
      for (int k = 0; k < 3; ++k) to[k * line_ + chunk.nodes[a]] = chunk.part[static_cast<Eigen::Index>(3 * a) + k];
  }
}

/// Sets the initial guess: the parabola through the last three solutions, or a lower order if there are fewer.
void StokesletFluid::guess() {
  image_ = memory_.solution;
  if (memory_.known == 0)
    memory_.solution.setZero();
  else if (memory_.known == 2)
    memory_.solution = 2.0 * image_ - memory_.past[0];
  else if (memory_.known == 3)
    memory_.solution = 3.0 * (image_ - memory_.past[0]) + memory_.past[1];
  if (memory_.known >= 2) memory_.past[1].swap(memory_.past[0]);
  if (memory_.known >= 1) memory_.past[0].swap(image_);
  memory_.known = std::min(memory_.known + 1, 3);
}

/// Conjugate gradients.
bool StokesletFluid::iterate(double tolerance) {
  const BlockMatrix matrix{model_.node_count, line_, lower_.data(), diagonal_.data()};
  const auto multiply = [&](const VectorX& x, VectorX& y) { stokeslet_kernels().multiply(matrix, x.data(), y.data()); };
  const double wanted = tolerance * right_.norm();
  multiply(memory_.solution, residual_);
  residual_ = right_ - residual_;
  double before = 0.0;
  for (memory_.iterations = 0; memory_.iterations < kMostIterations; ++memory_.iterations) {
    if (residual_.norm() <= wanted) return true;
    precondition(residual_, scaled_);
    const double now = residual_.dot(scaled_);
    if (!std::isfinite(now)) return false;
    if (memory_.iterations == 0)
      search_ = scaled_;
    else
      search_ = scaled_ + (now / before) * search_;
    before = now;
    multiply(search_, image_);
    const double step = now / search_.dot(image_);
    memory_.solution += step * search_;
    residual_ -= step * image_;
  }
  return false;
}

bool StokesletFluid::solve(const VectorX& q, const VectorX& velocity, VectorX& force) {
  place(q);
  assemble();
  for (int i = 0; i < model_.node_count; ++i)
    for (int k = 0; k < model_.dimension; ++k) right_[k * line_ + i] = velocity[model_.node_dof[at(i)] + k];
  // An old factorisation serves until it has become half as slow again as it was.
  const bool fresh = memory_.factorized_at.size() == 0 ||
                     memory_.iterations > memory_.fresh_iterations + std::max(3, memory_.fresh_iterations / 2);
  if (fresh && !factorize(q)) {
    forget();
    return false;
  }
  guess();
  const bool found = iterate(kTolerance);
  if (fresh) memory_.fresh_iterations = memory_.iterations;
  if (!found) {
    forget();
    return false;
  }
  force.setZero(velocity.size());
  for (int i = 0; i < model_.node_count; ++i)
    for (int k = 0; k < model_.dimension; ++k)
      force[model_.node_dof[at(i)] + k] = -8.0 * std::numbers::pi * memory_.solution[k * line_ + i];
  return true;
}

/// Computes y, the force of local drag and inertia at the velocities x.
void StokesletFluid::multiply_held(const VectorX& x, VectorX& y) const {
  for (int k = 0; k < model_.dimension; ++k) {
    const double* from = x.data() + k * line_;
    double* to = y.data() + k * line_;
    for (int i = 0; i < model_.node_count; ++i) to[i] = held_[i] * from[i];
    for (int e = 0; e < model_.edge_count; ++e) {
      const int a = model_.edge_tail[at(e)], b = model_.edge_head[at(e)];
      const double pair = edge_drag_[e] * (from[a] - from[b]);
      to[a] += pair;
      to[b] -= pair;
    }
  }
}

/// Applies its inverse to x, approximately, by conjugate gradients.
void StokesletFluid::solve_held(VectorX& x) {
  residual_ = x;
  x.setZero();
  double before = 0.0;
  const double wanted = kRough * residual_.norm();
  for (int i = 0; i < kMostIterations && residual_.norm() > wanted; ++i) {
    for (int k = 0; k < 3; ++k)
      scaled_.segment(k * line_, model_.node_count) =
          residual_.segment(k * line_, model_.node_count).cwiseQuotient(held_);
    const double now = residual_.dot(scaled_);
    search_ = scaled_ + (i == 0 ? 0.0 : now / before) * search_;
    before = now;
    multiply_held(search_, image_);
    const double step = now / search_.dot(image_);
    x += step * search_;
    residual_ -= step * image_;
  }
}

/// One power iteration. Returns the resistance of the resulting motion relative to that of local drag and inertia.
double StokesletFluid::sharpen_wave() {
  right_ = memory_.wave;
  memory_.solution.setZero();
  if (!iterate(kRough)) return 1.0;
  multiply_held(memory_.wave, image_);
  const double ratio = 8.0 * std::numbers::pi * memory_.wave.dot(memory_.solution) / memory_.wave.dot(image_);
  memory_.wave = memory_.solution;
  solve_held(memory_.wave);
  memory_.wave /= memory_.wave.norm();
  return ratio;
}

double StokesletFluid::excess(const VectorX& inertia, double limit) {
  if (memory_.waited > 0) {
    --memory_.waited;
    return memory_.excess;
  }
  const bool first = memory_.wave.isZero(0.0);
  if (first)
    for (int k = 0; k < model_.dimension; ++k)
      for (int i = 0; i < model_.node_count; ++i)
        memory_.wave[k * line_ + i] = std::sin(1.0 + 7.0 * i + 2.0 * k) + (i % 2);
  held_ = node_drag_ + inertia;
  kept_.swap(memory_.solution);
  const int iterations = memory_.iterations;
  double ratio = 0.0;
  for (int i = 0; i < (first ? 12 : 2); ++i) ratio = sharpen_wave();
  kept_.swap(memory_.solution);
  memory_.iterations = iterations;
  // R <= ratio (D + M) is to be <= limit (excess D + M). An iteration comes from below.
  const double wanted = 1.05 * ratio, share = inertia.cwiseQuotient(node_drag_).maxCoeff();
  const double needed = (wanted + std::max(wanted - limit, 0.0) * share) / limit;
  memory_.excess = needed <= 1.0 ? 1.0 : std::exp2(0.5 * std::ceil(2.0 * std::log2(needed)));
  memory_.waited = kWait;
  return memory_.excess;
}

Eigen::MatrixXd StokesletFluid::mobility(const VectorX& q) {
  place(q);
  assemble();
  const int n = model_.node_count;
  Eigen::MatrixXd out(3 * n, 3 * n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          out(3 * i + k, 3 * j + l) = out(3 * j + l, 3 * i + k) =
              i == j ? diagonal_[kEntry[k][l] * line_ + i] : row(i, kEntry[k][l])[j];
  return out;
}

}  // namespace withe
