#pragma once
/// Equilibria along a factor s, which drives supports, natural shapes, tensions and loads. The equation is
///   F(q, s) = grad V(q, s) - f(s) - (1 - s) r = 0, where held unknowns have their positions of s.
/// r is the imbalance of forces at the start s = 0. The path therefore begins there, and ends at s = 1 in equilibrium.

#include <functional>

#include "integrators/newton.hpp"
#include "model/actuation.hpp"

namespace withe {

/// Supports at a factor.
struct Boundary {
  /// Supports, obstacles and custom forces at the factor last gone to; must outlive the path.
  const Prescribed& prescribed = Prescribed::nothing();
  /// Sets the held unknowns of q to those at `factor`. Returns false if a frame would turn too far from the present
  /// state, which is the state at `present`.
  std::function<bool(double present, double factor, VectorX& q)> hold = nullptr;
  /// Sets the poses of supports in `prescribed` to those at a factor; does nothing if no yielding hand moves.
  std::function<void(double factor)> move = nullptr;
};
/// Sets the parameters that act at a factor; empty if all of them are constant.
using ActingPath = std::function<void(double factor, Parameters& parameters)>;

/// Returns the path of parameters that change with the factor:
///
/// - natural shapes and tensions, from `before` (if they have changed) to the present ones. Rods are then bent by their
///   muscles and tendons, not by the imbalance.
/// - loads that turn with the rod (moments, followers), from the share that the state carries already to all of them.
///   An imbalance of fixed direction would pull elsewhere.
///
/// Other loads are constant, and part of the imbalance.
ActingPath growing(Equations& equations, Parameters& parameters, const Prescribed& prescribed, const State& state,
                   NewtonWorkspace& work, const Actuation* before);

class Homotopy {
 public:
  /// The acting parameters are those of the last factor.
  Homotopy(Equations& equations, const Newton& newton, Parameters& parameters, Boundary boundary, ActingPath acting,
           State& state, NewtonWorkspace& work)
      : equations_(equations),
        newton_(newton),
        parameters_(parameters),
        boundary_(std::move(boundary)),
        acting_(std::move(acting)),
        state_(state),
        work_(work) {}

  /// Makes the present state that of s = 0, with its imbalance of forces.
  void start_out_of_balance();
  /// Loads and imbalance at a factor; the frames count from the present state.
  void go_to(double factor);
  bool hold(double factor, VectorX& q) const { return boundary_.hold(present_, factor, q); }
  const Prescribed& prescribed() const { return boundary_.prescribed; }
  /// From here on tangents have no component along neutral motions.
  void hold_neutral() { hold_neutral_ = true; }
  /// True if supports moved where a tangent was last found.
  bool supports_move() const { return moves_; }
  /// Target of grad V - f at the last factor.
  const VectorX& target() const { return target_; }

  /// Tangent of the path at the present state, and its stability.
  struct Tangent {
    VectorX rate;                 ///< dq / ds
    double turn = 0;              ///< rotation of edges, per factor [rad]
    Factorization factorization;  ///< factorisation of the stiffness
    bool found = false;
  };
  /// At the factor last gone to: the linear solution K dq/ds = df/ds - r - K q_held', the last by a difference.
  void find_tangent(Tangent& out);
  /// -dF/ds at z, projected, at the factor last gone to; `held`: how the held unknowns change with it.
  void find_pull(const VectorX& z, VectorX& pull, VectorX& held);
  /// Makes contact stiffer where surfaces at q are too deep in each other; whether q is out of balance by that.
  bool stiffen_deep(const VectorX& q);
  /// Continues from q: updates contacts, frames and hands.
  void accept(const VectorX& q);
  /// Makes an earlier state, that at a factor, the present one.
  void go_back(const State& state, double factor) {
    state_ = state;
    present_ = factor;
  }
  /// Residual F(z, s), and optionally the matrix.
  void evaluate(const VectorX& z, bool with_matrix, const double* axial_force);

 private:
  /// Sets parameters and hands to a factor, and begins a problem with these.
  void apply(double factor);

  Equations& equations_;
  const Newton& newton_;
  Parameters& parameters_;
  Boundary boundary_;
  ActingPath acting_;
  State& state_;
  NewtonWorkspace& work_;
  VectorX imbalance_, target_, held_, moved_, shift_;
  Configuration scratch_;
  double factor_ = 0.0, present_ = 0.0;  // last computed; that of the present state
  /// Largest overlap of surfaces on the path, over the smaller radius. The imbalance holds surfaces in an obstacle that
  /// was pushed into them. Contact need not be stiff enough for this force.
  double deepest_ = kMaxDepth;
  bool moves_ = false, hold_neutral_ = false;
};

}  // namespace withe
