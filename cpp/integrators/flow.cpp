// The force of a viscous fluid.
//
// Stokeslets: the force of the fluid is F(v) = -R v, with R dense. With velocities v* guessed before the step and u
// those of the step, D (v* - u) - R v* acts, D a local drag: at u = v* that is F, and what it leaves is (D - R) (u -
// v*), of the order of the scheme where v* is. On modes that neither mass nor stiffness hold back, u = (1 - R / D) v*
// under backward Euler, where v* is the last u: stable for R up to 2 D, and beyond where mass over the step or
// stiffness times it is as great. Under the midpoint rules, where v* is extrapolated from the last two, the roots of
// x^2 = (1 - R / D) (2 x - 1) stay in the unit circle for R up to 4/3 D (stiffness does not help a velocity that
// changes sign each step). D is as great as R along single rods; rods that nearly touch resist each other more, and
// D grows where mass over the step is too small for that. The midpoint rules then take the last u for v*, which is
// stable for R up to 2 D whatever the stiffness, but of first order: extrapolated, slow motions that meet a tenth of D
// would grow.

#include "integrators/equations.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

bool Equations::begin_flow(const VectorX& q, const VectorX& v) {
  pass_mark();
  if (!fluid_->solve(q, v, flow_start_)) return false;
  const double viscosity = parameters_->fluid_viscosity, duration = inner_ == Inner::middle ? 2.0 * h_ : h_;
  flow_inertia_ = parameters_->node_mass / (viscosity * duration);
  const double excess = fluid_->excess(flow_inertia_, inner_ == Inner::middle ? 1.3 : 1.9);
  if (excess != flow_excess_ || flow_version_ != parameters_->version)
    fluid_->set_local_drag(excess * viscosity, flow_drag_);
  flow_excess_ = excess;
  flow_version_ = parameters_->version;
  multiply(model_, flow_drag_, v, flow_);
  flow_start_ = viscosity * flow_start_ + flow_;
  flowing_ = true;
  return true;
}

/// The fluid's force on velocities (z - q0) / h.
void Equations::add_flow(const VectorX& z, bool with_matrix, Evaluation& out) {
  const double inverse = 1.0 / h_;
  flow_change_ = inverse * (z - state_->q);
  multiply(model_, flow_drag_, flow_change_, flow_);
  out.magnitude += flow_start_.cwiseAbs() + flow_.cwiseAbs();
  flow_ = flow_start_ - flow_;
  out.full_residual -= flow_;
  if (!with_matrix) return;
  const std::span<double> values = assembler_.solver().values();
  const std::vector<std::ptrdiff_t>& diagonal = assembler_.diagonal_offsets();
  for (int i = 0; i < model_.dof_count; ++i)
    values[static_cast<std::size_t>(diagonal[at(i)])] += inverse * flow_drag_.rows[i];
  add_coupling(flow_drag_.coupling, inverse, values);
}

void Equations::forget_flow() {
  if (fluid_) fluid_->forget();
  flow_excess_ = 0.0;
}

void Equations::find_resistance() {
  const SceneDescription& scene = model_.description;
  for (int e = 0; e < model_.edge_count; ++e) {
    const auto rod = at(model_.edge_rod[at(e)]);
    const RodDescription& d = scene.rods[rod];
    const double radius = d.contact_radius[e - model_.rod_first_edge[rod]];
    resistance_.push_back(resistive_coefficients(radius, d.rest_lengths.sum(), scene.fluid.wavelength));
  }
}

void Equations::resistive_local_at(int edge, const VectorX& z, bool with_hessian, Local& local) const {
  const EdgeFrame<double>& f = middle_.edge[at(edge)];
  const double half = 0.5 * model_.edge_length[edge] * parameters_->fluid_viscosity;
  ResistiveEdge resistive{.dimension = model_.dimension,
                          .along = half * resistance_[at(edge)].along,
                          .across = half * resistance_[at(edge)].across,
                          .tangent = {f.tangent.x, f.tangent.y, f.tangent.z},
                          .inverse_length = f.inverse_length,
                          .change = {},
                          .inverse_duration = 1.0 / h_};
  const int dof[2] = {model_.tail_dof[at(edge)], model_.head_dof[at(edge)]};
  for (int end = 0; end < 2; ++end)
    for (int k = 0; k < model_.dimension; ++k) resistive.change[end][k] = z[dof[end] + k] - state_->q[dof[end] + k];
  resistive_local(resistive, with_hessian, local);
}

void Equations::add_resistance(const VectorX& z, bool with_matrix) {
  Local local;
  for (int e = 0; e < model_.edge_count; ++e) {
    resistive_local_at(e, z, with_matrix, local);
    assembler_.stretch.add_gradient(e, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) assembler_.stretch.add_hessian(e, local.hessian, 1.0, assembler_.solver().values());
  }
}

/// What the fluid takes over `change` with the forces of the last evaluation [J].
double Equations::flow_loss(const VectorX& change) const {
  if (flowing_) return -flow_.dot(change);
  double work = 0.0;
  if (resistance_.empty() || h_ == 0.0) return work;
  Local local;
  for (int e = 0; e < model_.edge_count; ++e) {
    resistive_local_at(e, last_z_, false, local);
    const int* dofs = assembler_.stretch.dofs(e);
    for (int k = 0; k < assembler_.stretch.width(); ++k) work += local.gradient[k] * change[dofs[k]];
  }
  return work;
}

}  // namespace withe
