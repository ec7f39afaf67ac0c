#pragma once
/// Equilibria of a running scene: the way of its supports, contact that presses as hard as it has to, and failures.

#include <functional>
#include <string>
#include <vector>

#include "integrators/statics.hpp"
#include "run/running.hpp"

namespace withe {

/// Finds poses between two places of each support, or beyond. A rotation is exp(s swing) R exp(s roll).
void find_poses_between(const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to, double fraction,
                        std::vector<SupportPose>& out);
void put(const std::vector<SupportPose>& poses, std::vector<SupportMotion>& motions);
/// Has a support stay where it is.
void stop(SupportMotion& motion, double time);

/// Boundary of statics with supports between two places. All arguments must outlive it; the poses in `out` follow where
/// a hand that yields moves.
Boundary boundary_between(const Model& model, const Moving& now, Equations& system,
                          const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to,
                          Prescribed& out);

/// True if nothing resists a translation along which forces do not sum to zero: no way leads to equilibrium then.
/// Surfaces, and custom forces with a Jacobian, may resist elsewhere. `e` is scratch.
bool drifts(const Model& model, const Parameters& parameters, const State& state, Equations& system,
            const Prescribed& given, StepData& e);

/// Gives contacts the stiffness of those that are yet to come and, at an equilibrium that was reached, the stiffness
/// that their forces need without being deep; see `ContactStiffness`. True if that changed nothing.
bool even_contact(const Parameters& parameters, Equations& system, const Prescribed& given, bool arrived, State& state);
/// Makes contact stiffer that is too soft in the equilibrium that was found, and seeks balance again. Does so too where
/// contact is far too stiff for its forces, or where surfaces are deeper in each other than forces need. It keeps the
/// new equilibrium only where surfaces are less deep: they are not where they are pressed by what does not yield.
/// `find` seeks from the present state.
void settle_contact(Equations& system, const Parameters& parameters, const Prescribed& given,
                    const std::function<StaticResult()>& find, State& state, StaticResult& r);

/// Message that no equilibrium was found, with the likely reason.
std::string no_equilibrium(const Model& model, const StaticResult& result);

}  // namespace withe
