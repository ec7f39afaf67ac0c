#pragma once
/// Stretching, bending and twisting, and their viscosity; in energy-momentum steps the discrete gradient of both:
/// viscosity is elasticity towards the strain s0 at the start, k s + (kv / h) (s - s0), in every scheme.

#include "steps/term.hpp"

namespace withe {

class ElasticForces final : public Term {
 public:
  explicit ElasticForces(const Model& model) : inverse_rest_(model.edge_length.cwiseInverse()) {}

  bool dissipates(const Parameters& parameters) const override { return parameters.viscous; }
  void begin(StepProblem& problem) override;
  void find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;
  /// Elastic forces alone, with velocities v the couple of edges that spin and turn as well.
  void add_explicit(const StepProblem& problem, StepData& data, const Assembler& assembler,
                    const VectorX& v) const override;
  /// An axial strain rounds along its edge only.
  void add_rounding(const StepProblem& problem, StepData& data) const override;

 private:
  void set_axial_forces(const StepProblem& problem, const ElasticCoefficients& k, StepData& data) const;
  static double discrete_dissipation(const StepProblem& problem, const StepData& data);
  void set_mean_axial_forces(const StepProblem& problem, StepData& data) const;
  void add_elastic(const StepProblem& problem, const ElasticCoefficients& k, StepData& data, const Assembler& assembler,
                   std::span<double> values, const double* axial_force) const;
  void add_others(const StepProblem& problem, const ElasticCoefficients& k, StepData& data, const Assembler& assembler,
                  std::span<double> values, const double* axial_force) const;
  void add_discrete_gradient(const StepProblem& problem, StepData& data, const Assembler& assembler,
                             std::span<double> values) const;

  void add_rate_slopes(const StepProblem& problem, StepData& data, const Assembler& assembler,
                       std::span<double> values) const;
  void add_discrete_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                            StepAdjoint& adjoint) const;
  void add_half_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                        StepAdjoint& adjoint) const;

  VectorX inverse_rest_;  ///< per edge: 1 / L [1 / m]
};

/// Visits stencils that kernels for gradients do not take: in a plane all.
template <class Visit>
void for_each_single_bend(const Model& model, const Assembler& assembler, const Visit& visit) {
  if (model.planar())
    for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) visit(b);
  else
    for (int b : assembler.regular.other_bend) visit(b);
}

/// Largest angle by which an edge turns on the way from q0 to q1 [rad], > pi/2 where it ends pointing back.
double largest_turn(const Model& model, const VectorX& q0, const VectorX& q1);

/// Coefficients of an evaluation: elasticity, with viscosity where the rule takes both as one.
const ElasticCoefficients& acting_coefficients(const StepProblem& problem, const StepData& data);

/// Axial forces [N] as the mixed method wants them: linearly extrapolated from the last evaluation by a
/// Newton step, n <- EA (eps + d eps . dz).
void predict_axial_force(const StepProblem& problem, const StepData& data, const VectorX& step, VectorX& out);

}  // namespace withe
