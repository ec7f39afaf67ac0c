#include "run/systems.hpp"

#include <utility>

#include "common/check.hpp"

namespace withe {
namespace {

std::size_t at(System which) { return static_cast<std::size_t>(which); }

/// True if equations of the scheme are symmetric at rest, and have every force of an equilibrium.
bool serves_statics(const SceneDescription& scene, Integrator integrator) {
  if (integrator == Integrator::statics) return true;
  if (integrator == Integrator::energy_momentum || scene.fluid.model == FluidModel::resistive) return false;
  return !scene.has_custom_force || scene.custom_implicit;
}

}  // namespace

void Systems::build(const Model& model, const Options& options) {
  drop_others();
  model_ = &model;
  options_ = &options;
  if (options.threads == 1)
    workers_.reset();
  else if (!workers_ || workers_->workers() != options.threads)
    workers_ = std::make_unique<WorkerPool>(options.threads);
  newton_ = std::make_unique<Newton>(model, options);
  scheme_ = std::make_unique<Equations>(model, shared(options));
}

void Systems::drop_others() {
  statics_.reset();
  readout_.reset();
  gradient_.reset();
}

void Systems::drop_scratch() {
  drop_others();
  StepWorkspace fresh;
  fresh.newton.counters = work.newton.counters;
  fresh.newton.finest = work.newton.finest;
  fresh.newton.poll = work.newton.poll;
  work = std::move(fresh);
}

EquationOptions Systems::shared(const Options& options) const {
  EquationOptions result = equation_options(options);
  result.workers = workers_.get();
  return result;
}

EquationOptions Systems::static_options() const {
  Options symmetric = *options_;
  symmetric.integrator = Integrator::statics;
  return shared(symmetric);
}

Equations& Systems::statics() {
  if (serves_statics(model_->description, options_->integrator)) return *scheme_;
  if (!statics_) statics_ = std::make_unique<Equations>(*model_, static_options());
  return *statics_;
}

Equations& Systems::readout() const {
  if (!readout_) readout_ = std::make_unique<Equations>(*model_, static_options());
  return *readout_;
}

StepGradient& Systems::gradient() const {
  if (!gradient_) gradient_ = std::make_unique<StepGradient>(*model_, static_options());
  return *gradient_;
}

Equations* Systems::find(System which) const {
  switch (which) {
    case System::scheme:
      return scheme_.get();
    case System::statics:
      return statics_.get();
  }
  return nullptr;
}

Lagged Systems::lagged() const {
  Lagged out;
  const MatrixRecord& matrix = work.newton.matrix;
  out.matrix = matrix;
  out.guesses = work.newton.guesses;
  for (const System which : kSystems) {
    const Equations* known = find(which);
    if (!known) continue;
    const bool owns = matrix.owner == known && matrix.generation == known->assembler().generation();
    if (owns) out.owner = which;
    out.systems[at(which)] = known->memory(owns);
  }
  return out;
}

/// The same matrix makes the same factorisation.
void Systems::recall(const Lagged& past) {
  bool fits = true;
  for (const System which : kSystems) {
    const auto& memory = past.systems[at(which)];
    if (!memory && which == System::statics) statics_.reset();
    if (!memory) continue;
    if (which == System::statics) statics();
    require(find(which) != nullptr, "equations of another scene");
    if (!find(which)->recall(*memory) && past.owner == which) fits = false;
  }
  MatrixRecord& matrix = work.newton.matrix;
  static_cast<MatrixHistory&>(matrix) = past.matrix;
  matrix.owner = nullptr;
  work.newton.guesses = past.guesses;
  if (past.owner && fits) factorize_again(*past.owner);
}

/// With the matrix as it is; users count what steps factorise.
void Systems::factorize_again(System which) {
  Equations& owner = *find(which);
  const Counters counters = work.newton.counters;
  require(factorize(owner, work.newton), "a matrix of another scene");
  work.newton.counters = counters;
  work.newton.matrix.owner = &owner;
  work.newton.matrix.generation = owner.assembler().generation();
  work.newton.matrix.factorized = true;
}

void Systems::mark() {
  marked_matrix_ = work.newton.matrix;
  marked_guesses_ = work.newton.guesses;
  for (const System which : kSystems)
    if (Equations* known = find(which)) known->mark();
}

void Systems::return_to_mark() {
  if (!scheme_->marked()) {  // built after the mark, for other supports or outside of a plane
    forget_matrix();
    return;
  }
  if (statics_ && !statics_->marked()) statics_.reset();
  work.newton.matrix = marked_matrix_;
  work.newton.guesses = marked_guesses_;
  for (const System which : kSystems) {
    Equations* known = find(which);
    const EquationsMemory* before = known ? known->since_mark() : nullptr;
    if (!before) continue;
    if (known->recall(*before) && marked_matrix_.owner == known) factorize_again(which);
  }
}

void Systems::forget_matrix() {
  work.newton.matrix = MatrixRecord{};
  work.newton.guesses = GuessRecords{};
  for (const System which : kSystems)
    if (Equations* known = find(which)) known->forget_flow();
}

void Systems::forget_contacts() {
  for (const System which : kSystems)
    if (Equations* known = find(which); known && known->contact()) known->forget_contacts();
}

}  // namespace withe
