#pragma once
/// Velocities after impacts with a restitution below 1, see contact/rebound.hpp.

#include <vector>

#include "contact/rebound.hpp"
#include "steps/equations.hpp"
#include "steps/mass_system.hpp"

namespace withe {

/// Change of the energy balance by impulses [J].
struct ReboundWork {
  double dissipated = 0;
  double support_work = 0;  ///< of supports and obstacles
  /// Energy that forces of impacts have put in, and that no impulses remove, over the kinetic energy [-]. A step is too
  /// long if these forces have bent rods by that much.
  double gain = 0;
};

/// Impulses at the end of a step, with their scratch.
class Rebounds {
 public:
  /// Notes the contacts of a step that is about to be accepted. True if impulses apply.
  bool find(const Equations& equations);
  /// Changes the velocities of the state at the end of the step. `find` must have returned true. `lost`: energy that
  /// contact has removed in the step [J].
  ReboundWork apply(const Model& model, const Parameters& parameters, double lost, MassSystem& masses, State& state);

 private:
  /// Finds the velocity after impulses, and their work.
  ReboundWork find_velocity(const Model& model, const State& state, double elastic, MassSystem& masses,
                            VectorX& velocity);
  void set_batches(const Model& model);
  void set_rows(const Model& model, const std::vector<std::size_t>& batch, std::size_t k, MassSystem& masses);

  std::vector<ReboundContact> contacts_;
  std::vector<ReboundRows> rows_;
  std::vector<Impulse> impulses_;
  std::vector<std::vector<std::size_t>> batches_;
  std::vector<int> owner_;  ///< per component, the contact of a batch
  VectorX row_, column_, total_, velocity_, least_;
};

}  // namespace withe
