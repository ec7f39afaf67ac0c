#pragma once
/// Equations of a scene by purpose, each made when it is first needed, and what their solves leave for later ones.

#include <array>
#include <memory>
#include <optional>

#include "common/worker_pool.hpp"
#include "gradients/step_gradient.hpp"
#include "integrators/dynamics.hpp"

namespace withe {

/// Systems of equations whose factorisation may serve again.
enum class System { scheme, statics };
inline constexpr std::array<System, 2> kSystems{System::scheme, System::statics};

/// Memory of all solves: with it, a copy goes on with the same bits.
struct Lagged {
  MatrixHistory matrix;
  GuessRecords guesses;
  std::optional<System> owner;  ///< of the factorisation that may serve again
  std::array<std::optional<EquationsMemory>, kSystems.size()> systems;
};

class Systems {
 public:
  /// Makes the equations of the scheme, and drops all others. Model and options must outlive them.
  void build(const Model& model, const Options& options);
  /// Drops all equations but those of the scheme.
  void drop_others();
  /// Drops what has the sizes of the model; counters, the check for interruptions and the finest step stay.
  void drop_scratch();

  const Newton& newton() const { return *newton_; }
  /// Equations of the time steps.
  Equations& scheme() const { return *scheme_; }
  /// Symmetric equations of equilibria; those of the scheme where they are that.
  Equations& statics();
  /// Symmetric equations for read-outs, which leave every factorisation alone.
  Equations& readout() const;
  /// Form of symmetric equations of equilibria.
  EquationOptions static_options() const;
  /// The adjoint of equilibria.
  StepGradient& gradient() const;
  /// Nothing where there are no such equations yet.
  Equations* find(System which) const;

  Lagged lagged() const;
  void recall(const Lagged& past);
  /// From here on a step may end without a trace; `return_to_mark` then makes it so.
  void mark();
  void return_to_mark();
  void forget_matrix();
  void forget_contacts();

  StepWorkspace work;

 private:
  /// Form of the equations of some options, whose work the threads of this scene share.
  EquationOptions shared(const Options& options) const;
  void factorize_again(System owner);

  const Model* model_ = nullptr;
  const Options* options_ = nullptr;
  std::unique_ptr<WorkerPool> workers_;  ///< none where one thread does the work
  std::unique_ptr<Newton> newton_;
  std::unique_ptr<Equations> scheme_, statics_;
  mutable std::unique_ptr<Equations> readout_;
  mutable std::unique_ptr<StepGradient> gradient_;
  MatrixRecord marked_matrix_;
  GuessRecords marked_guesses_;
};

}  // namespace withe
