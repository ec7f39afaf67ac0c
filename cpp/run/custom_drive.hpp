#pragma once
/// Custom forces of a scene: computed by a user's function, and noted as the present ones.

#include "forces/custom_forces.hpp"
#include "run/running.hpp"

namespace withe {

/// A view; its arguments must outlive it and the responses that it makes. Without a function the last forces stay.
class CustomDrive {
 public:
  CustomDrive(const Model& model, const CustomFunction& function, Found& found)
      : model_(&model), function_(&function), found_(&found) {}

  bool has_function() const { return static_cast<bool>(*function_); }
  /// Evaluates the function. Throws std::invalid_argument unless tables and derivatives have the shapes of the scene,
  /// and forces stay in its plane.
  CustomForces evaluate(double time, const VectorX& q, const VectorX& v, bool derivatives) const;
  /// Evaluates forces that become the present ones.
  void find(double time, const VectorX& q, const VectorX& v) { note(evaluate(time, q, v, false)); }

  /// The present forces, and nothing else.
  Prescribed at_rest() const;
  /// Prescribes the present forces.
  void put(Prescribed& out) const;
  /// Prescribes forces at a time, which are solved for.
  void put_response(double time, Prescribed& out) const;
  /// Forces at a time without velocities; empty without a function.
  CustomResponse response_at_rest(double time) const;
  /// Prescribes forces at a time without velocities, which are solved for.
  void put_response_at_rest(double time, Prescribed& out) const;

 private:
  void note(const CustomForces& now) const;

  const Model* model_;
  const CustomFunction* function_;
  Found* found_;
};

}  // namespace withe
