// What steps add to elastic energy beyond the work of elastic forces.

#include <algorithm>
#include <cmath>

#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

/// An edge at both ends of a step: squares of its length, their product, and the change.
struct EdgeWay {
  double before = 0.0, after = 0.0, across = 0.0;
  Vec3d start, change;

  EdgeWay(const Model& model, const VectorX& q0, const VectorX& q1, int edge) {
    const int a = model.tail_dof[at(edge)], b = model.head_dof[at(edge)], n = model.dimension;
    const auto along = [&](const VectorX& q) {
      return Vec3d{q(b) - q(a), q(b + 1) - q(a + 1), n > 2 ? q(b + 2) - q(a + 2) : 0.0};
    };
    start = along(q0);
    const Vec3d end = along(q1);
    change = end - start;
    across = dot(start, end);
    before = dot(start, start);
    after = dot(end, end);
  }

  /// The square of the cosine, with its sign.
  double square() const { return across * std::abs(across) / (before * after); }

  /// Of an edge of stiffness 1 N whose force is that in the step's middle, or at its end. One under pressure that turns
  /// gains by the latter: it gives way by l0 (1 - cos). Small as it is, it is made of no differences of lengths.
  double stretch_gain(double rest, bool at_end) const {
    const double l0 = std::sqrt(before), l1 = std::sqrt(after);
    const Vec3d turned = cross(start, change);
    const double away = dot(turned, turned) / (l0 * l1 + across);  // l0 l1 (1 - cos)
    if (at_end) return away / l1 - 0.5 * dot(change, change) / rest;
    const double middle = 0.5 * std::sqrt(std::max(before + after + 2.0 * across, 0.0));
    return middle > 0.0 ? (l1 - l0) * away / ((l0 + l1 + 2.0 * middle) * middle) : 0.0;
  }
};

double angle_of(double square) {
  return std::isfinite(square) ? std::acos(std::copysign(std::sqrt(std::min(std::abs(square), 1.0)), square))
                               : INFINITY;
}

}  // namespace

double largest_turn(const Model& model, const VectorX& q0, const VectorX& q1) {
  double smallest = 1.0;
  for (int e = 0; e < model.edge_count; ++e) {
    const double square = EdgeWay(model, q0, q1, e).square();
    if (!(square >= smallest)) smallest = square;
  }
  return angle_of(smallest);
}

void ElasticForces::add_gains(const StepProblem& problem, StepData& data, const Assembler& assembler,
                              const VectorX& end, ComponentGains& gains) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.elastic;
  gains.turn.setOnes(model.component_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const EdgeWay way(model, problem.start->q, end, e);
    const int component = model.component_of_edge(e);
    double& smallest = gains.turn[component];
    if (const double square = way.square(); !(square >= smallest)) smallest = square;
    // With a natural strain n: an edge of rest length (1 + n) L and stiffness (1 + n) EA.
    const double natural = 1.0 + k.stretch_natural(e);
    gains.energy[component] +=
        natural * k.stretch_stiffness(e) * way.stretch_gain(natural * model.edge_length(e), !problem.in_middle());
  }
  gains.whole.assign(at(model.component_count), 0);
  for (int i = 0; i < model.component_count; ++i) {
    gains.turn[i] = angle_of(gains.turn[i]);
    if (std::isfinite(gains.turn[i]))
      gains.whole[at(i)] = gains.turn[i] > gains.small_turn || std::abs(gains.energy[i]) > gains.small_gain[i];
  }
  if (gains.any_whole()) add_bend_gains(problem, data, assembler, end, gains);
}

void ElasticForces::add_bend_gains(const StepProblem& problem, StepData& data, const Assembler& assembler,
                                   const VectorX& end, ComponentGains& gains) const {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.elastic;
  const VectorX& start = problem.start->q;
  Configuration& c = data.end_configuration;
  const auto each = [&](const auto& of_bend, const auto& of_half) {
    for (int b = 0; b < static_cast<int>(model.bend.size()); ++b)
      if (const int own = model.component_of_edge(model.bend[at(b)].edge[0]); gains.whole[at(own)])
        gains.energy[own] += of_bend(b);
    for (int h = 0; h < static_cast<int>(model.half.size()); ++h)
      if (const int own = model.component_of_edge(model.half[at(h)].edge); gains.whole[at(own)])
        gains.energy[own] += of_half(h);
  };
  const auto add_energies = [&](const VectorX& q, double sign) {
    compute_configuration(model, *problem.start, q, c);
    const auto both = [sign](const BendTwistEnergy& turned) { return sign * (turned.bend + turned.twist); };
    each([&](int b) { return both(bend_energy_of(k, c, b)); }, [&](int h) { return both(half_energy_of(k, c, h)); });
  };
  add_energies(start, -1.0);
  add_energies(end, 1.0);
  // The data are those of the solution.
  const Configuration& acting = data.configuration;
  Local local;
  const auto work = [&](const ElementTable& table, int element) {
    const int* dofs = table.dofs(element);
    double sum = 0.0;
    for (int i = 0; i < table.width(); ++i)
      if (dofs[i] >= 0) sum += local.gradient[i] * (end[dofs[i]] - start[dofs[i]]);
    return sum;
  };
  each(
      [&](int b) {
        bend_local(model, bend_coefficients(k, b), acting, b, false, local);
        return -work(assembler.bend, b);
      },
      [&](int h) {
        half_local(model, data.z, half_coefficients(k, h), acting, h, false, local);
        return -work(assembler.half, h);
      });
}

}  // namespace withe
