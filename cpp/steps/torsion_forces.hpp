#pragma once
/// Torsion springs between edges, see forces/torsion_spring.hpp.

#include <array>

#include "forces/torsion_spring.hpp"
#include "steps/term.hpp"

namespace withe {

/// Unknowns of two edges in space: tail, angle and head of each.
constexpr int kTorsionUnknowns = 14;

/// Places of the unknowns of an edge among those of its spring; an edge in a plane has no angle.
struct TorsionSeat {
  int edge = 0;
  int tail = -1, angle = -1, head = -1;
};

class TorsionForces final : public Term {
 public:
  explicit TorsionForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&table_); }
  std::string note() const override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;

 private:
  using Seats = std::array<TorsionSeat, 2>;
  std::vector<Seats> seats_;
  std::vector<TorsionArms<double>> carried_;  ///< components of the arms along d1, d2 and tangent of their edges
  ElementTable table_;
};

/// Energy of one spring in a configuration [J].
double torsion_energy(const Model& model, const PartNumbers& numbers, const Configuration& c, int spring);

}  // namespace withe
