#include "steps/equations.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "elasticity/stencil_kernels.hpp"
#include "steps/body_forces.hpp"
#include "steps/rounding.hpp"

namespace withe {
namespace {

long next_number() {
  static std::atomic<long> count{0};
  return ++count;
}

StepProblem problem_of(const Model& model) {
  StepProblem problem(model);
  problem.loads = resolve_loads(model);
  return problem;
}

std::vector<ElementTable*> tables_of(const Terms& terms) {
  std::vector<ElementTable*> tables;
  for (const std::unique_ptr<Term>& term : terms.all) term->declare(tables);
  return tables;
}

/// False if derivatives of a completed step are evaluated: they do not need bounds on rounding errors.
bool bounds_rounding(const StepProblem& problem) { return !(problem.exact && problem.moves()); }

}  // namespace

Equations::Equations(const Model& model, const EquationOptions& options)
    : problem_(problem_of(model)),
      terms_(make_terms(model, problem_.loads, options.rule, options.exact)),
      asymmetries_(asymmetries_of(model, problem_.loads, terms_, options.rule, options.exact)),
      assembler_(model, tables_of(terms_), asymmetries_.empty() ? Symmetry::symmetric : Symmetry::unsymmetric,
                 options.solver, options.exact),
      static_duration_(options.static_duration),
      joint_wrenches_(model) {
  assembler_.share_work(options.workers);
  problem_.exact = options.exact;
  if (contact()) {
    assembler_.couple(terms_.contact->rows().unknowns(), kContactUnknowns);
    ordered_ = terms_.contact->rows().keys();
  }
  for (const std::unique_ptr<Term>& term : terms_.all) {
    if (term->has_potential()) continue;
    has_potential_ = false;
    if (term.get() != terms_.contact) only_friction_has_none_ = false;
  }
}

bool Equations::has_potential_here() const {
  if (has_potential_) return true;
  if (!only_friction_has_none_ || !contact()) return false;
  const ContactSet& touching = contact()->contacts();
  return std::none_of(touching.begin(), touching.end(), [](const Touching& t) { return t.pair.rubs(); });
}

void Equations::set_parameters(const Parameters& parameters) {
  problem_.parameters = &parameters;
  if (problem_.natural_version != parameters.natural_version) set_natural(parameters, problem_.elastic);
  problem_.natural_version = parameters.natural_version;
  if (problem_.version == parameters.version) return;
  problem_.version = parameters.version;
  set_mass(model(), parameters, problem_.mass);
  set_gravity_force(model(), parameters, problem_.gravity);
  set_elastic(parameters, problem_.elastic);
  set_drag(model(), parameters, problem_.drag);
}

const Prescribed& Prescribed::nothing() {
  static const Prescribed none;
  return none;
}

void Equations::begin(const State& state, const Parameters& parameters, StepRule rule, double h,
                      const Prescribed& prescribed, const VectorX* held_acceleration) {
  set_parameters(parameters);
  problem_.start = &state;
  problem_.prescribed = &prescribed;
  problem_.rule = rule;
  problem_.interval = h;
  if (held_acceleration)
    problem_.held_acceleration = *held_acceleration;
  else
    problem_.held_acceleration.resize(0);
  if (model().has_bodies()) turn_bodies(model(), parameters, state, problem_.mass);
  problem_.number = next_number();
  problem_.slip_time = problem_.moves() ? problem_.duration() : static_duration_;
  for (const std::unique_ptr<Term>& term : terms_.all) term->begin(problem_);
}

bool Equations::begin_flow(const VectorX& q, const VectorX& v) {
  pass_mark();
  return terms_.stokeslets->solve(problem_, q, v);
}

void Equations::forget_flow() {
  if (terms_.stokeslets) terms_.stokeslets->forget();
}

void Equations::clear(const VectorX& z, StepData& data) const {
  data.potential = 0.0;
  data.gradient.setZero(model().dof_count + kPadding);
  data.row_magnitude.setZero(model().dof_count + kPadding);
  data.z = z;
  place_carried(problem_, data.z);
}

/// Finds the forces of all terms, and reserves their entries in the matrix.
void Equations::find(StepData& data, bool with_matrix) {
  for (const std::unique_ptr<Term>& term : terms_.all) {
    const int before = assembler_.generation();
    term->find(problem_, data, assembler_, with_matrix);
    if (terms_.contact && assembler_.generation() != before) ordered_ = terms_.contact->rows().keys();
  }
}

void Equations::evaluate(const VectorX& z, bool with_matrix, const double* axial_force, StepData& data,
                         const ContactLinearisation& contact) {
  clear(z, data);
  data.axial_force = axial_force;
  data.contact = &contact;
  if (with_matrix) pass_mark();
  find(data, with_matrix);
  if (bounds_rounding(problem_) && data.rounding.number != problem_.number) set_rounding_bounds(problem_, data);
  std::span<double> values;
  if (with_matrix) {
    values = assembler_.solver().values();
    std::fill(values.begin(), values.end(), 0.0);
  }
  for (const std::unique_ptr<Term>& term : terms_.all) term->add(problem_, data, assembler_, values);
  if (joint_wrenches_.any()) data.unfolded = data.gradient.head(model().dof_count);
  if (!model().carried.empty()) fold(data, values);
  finish(data);
  if (with_matrix && !problem_.exact) assembler_.project_matrix();
  data.axial_force = nullptr;
  data.contact = nullptr;
}

/// Adds the rows of parts that bodies carry to those of the bodies, and their derivatives where there is a matrix.
void Equations::fold(StepData& data, std::span<double> values) {
  // Like discrete gradients, these are moments: in a plane they do their work over the finite turn of a step.
  const bool moments = problem_.conserves_energy() && model().planar();
  if (moments) data.elastic_rows -= data.gradient.head(model().dof_count);
  if (values.empty()) {
    fold_rows(problem_, data.z, data.gradient, data.row_magnitude);
  } else {
    fold_rows(problem_, data.z, data.gradient, data.row_magnitude, data.carrying);
    fold_matrix(problem_, data.z, data.carrying, assembler_);
  }
  if (moments) data.elastic_rows += data.gradient.head(model().dof_count);
}

void Equations::finish(StepData& data) const {
  const int n = model().dof_count;
  data.full_residual = data.gradient.head(n);
  if (bounds_rounding(problem_)) {
    data.magnitude = data.row_magnitude.head(n);
    data.floor = data.rounding.rows + data.rounding.relative * data.magnitude;
    for (const std::unique_ptr<Term>& term : terms_.all) term->add_rounding(problem_, data);
    if (!model().carried.empty()) fold_bounds(problem_, data.floor);
  }
  data.residual = data.full_residual;
  assembler_.project(data.residual);
}

void Equations::evaluate_forces(const VectorX& v, StepData& data) const {
  clear(problem_.start->q, data);
  if (terms_.custom) data.custom = given_forces(problem_);
  data.axial_force = nullptr;
  for (const std::unique_ptr<Term>& term : terms_.all) term->add_explicit(problem_, data, assembler_, v);
  data.full_residual = data.gradient.head(model().dof_count);
}

bool Equations::dissipates(const Parameters& parameters) const {
  return std::any_of(terms_.all.begin(), terms_.all.end(),
                     [&](const std::unique_ptr<Term>& term) { return term->dissipates(parameters); });
}

std::vector<std::string> Equations::notes() const {
  std::vector<std::string> notes;
  for (const std::unique_ptr<Term>& term : terms_.all)
    if (std::string note = term->note(); !note.empty()) notes.push_back(std::move(note));
  return notes;
}

double Equations::dissipated(const StepData& data, const VectorX& change) const {
  double work = 0.0;
  for (const std::unique_ptr<Term>& term : terms_.all) work += term->dissipated(problem_, data, assembler_, change);
  return work;
}

void Equations::load_force(const StepData& data, VectorX& out) const {
  out.setZero(model().dof_count);
  for (const std::unique_ptr<Term>& term : terms_.all) term->add_applied(problem_, data, assembler_, out);
}

double Equations::allowed(const VectorX& z, const VectorX& step) {
  return terms_.contact ? terms_.contact->allowed(problem_, z, step) : 1.0;
}

bool Equations::touches(const VectorX& z) { return terms_.contact && terms_.contact->touches(problem_, z); }

void Equations::predict_friction(const VectorX& step, double kept, ContactLinearisation& linearisation) {
  if (terms_.contact) terms_.contact->predict_friction(problem_, step, kept, linearisation);
}

double Equations::contact_loss(const StepData& data, const VectorX& change, double obstacle_work) const {
  return terms_.contact->loss(data, change, obstacle_work);
}

}  // namespace withe
