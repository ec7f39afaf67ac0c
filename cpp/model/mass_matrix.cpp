#include "model/mass_matrix.hpp"

#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// Coupling of the nodes of each edge by a density, or drag, per length.
void set_coupling(const Model& model, const Parameters& p, const VectorX& density, VectorX& coupling) {
  if (p.lumped)
    coupling.setZero(model.edge_count);
  else
    coupling = density.cwiseProduct(model.edge_arc) / 6.0;
  for (int e = 0; e < model.edge_count; ++e)
    if (model.edge_lumped[at(e)] || (p.held_lumped && model.edge_held[at(e)])) coupling(e) = 0.0;
}

template <int Dimension>
void multiply_coupling(const Model& model, const VectorX& coupling, const VectorX& x, VectorX& out) {
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    const Eigen::Matrix<double, Dimension, 1> apart = coupling[e] * (x.segment<Dimension>(b) - x.segment<Dimension>(a));
    out.segment<Dimension>(a) += apart;
    out.segment<Dimension>(b) -= apart;
  }
}

}  // namespace

void set_mass(const Model& model, const Parameters& p, MassMatrix& mass) {
  VectorX& rows = mass.rows;
  rows.setZero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i)
    rows.segment(model.node_dof[at(i)], model.dimension).setConstant(p.node_mass(i));
  for (int f = 0; f < model.frame_count; ++f)
    rows.segment(model.frame_dof[at(f)], model.frame_size()).setConstant(p.frame_inertia(f));
  mass.bodies.clear();
  for (std::size_t b = 0; b < model.body_frame.size(); ++b) {
    const Matrix3& J = p.body_inertia[b];
    const double mean = model.planar() ? model.plane->normal.dot(J * model.plane->normal) : J.trace() / 3.0;
    rows.segment(model.frame_dof[at(model.body_frame[b])], model.frame_size()).array() += mean;
    if (!model.planar()) mass.bodies.push_back(J - mean * Matrix3::Identity());
  }
  for (std::size_t h = 0; h < model.hinges.size(); ++h)
    rows(model.hinges[h].dof) = p.hinge_inertia(static_cast<Eigen::Index>(h));
  if (!model.planar())
    for (int e = 0; e < model.edge_count; ++e) rows(model.edge_dof[at(e)]) = p.edge_inertia(e);
  mass.inverse = rows.cwiseMax(1e-300).cwiseInverse();
  set_coupling(model, p, p.edge_density, mass.coupling);
}

Matrix3 inertia_in_space(const Model& model, const Parameters& p, const State& state, int body) {
  const auto frame = at(model.body_frame[at(body)]);
  const Matrix3 R = cayley(state.q.segment<3>(model.frame_dof[frame])) * state.frame[frame];
  return R * p.body_inertia[at(body)] * R.transpose();
}

void turn_bodies(const Model& model, const Parameters& p, const State& state, MassMatrix& mass) {
  for (int b = 0; b < static_cast<int>(mass.bodies.size()); ++b)
    mass.bodies[at(b)] =
        inertia_in_space(model, p, state, b) - p.body_inertia[at(b)].trace() / 3.0 * Matrix3::Identity();
}

void set_drag(const Model& model, const Parameters& p, MassMatrix& drag) {
  drag.rows.setZero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i)
    drag.rows.segment(model.node_dof[at(i)], model.dimension).setConstant(p.node_drag(i));
  set_coupling(model, p, p.edge_drag, drag.coupling);
}

void multiply(const Model& model, const MassMatrix& mass, const VectorX& x, VectorX& out) {
  out = mass.rows.cwiseProduct(x);
  if (model.planar())
    multiply_coupling<2>(model, mass.coupling, x, out);
  else
    multiply_coupling<3>(model, mass.coupling, x, out);
  for (std::size_t b = 0; b < mass.bodies.size(); ++b) {
    const int dof = model.frame_dof[at(model.body_frame[b])];
    out.segment<3>(dof) += mass.bodies[b] * x.segment<3>(dof);
  }
}

void add_mass_adjoint(const Model& model, const VectorX& x, const VectorX& rows, VectorX& by_rows,
                      VectorX& by_coupling) {
  by_rows += rows.cwiseProduct(x);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    for (int i = 0; i < model.dimension; ++i) by_coupling[e] -= (rows[b + i] - rows[a + i]) * (x[b + i] - x[a + i]);
  }
}

double kinetic_energy(const Model& model, const MassMatrix& mass, const VectorX& v) {
  double twice = mass.rows.dot(v.cwiseAbs2());
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    for (int i = 0; i < model.dimension; ++i) twice -= mass.coupling[e] * (v[b + i] - v[a + i]) * (v[b + i] - v[a + i]);
  }
  for (std::size_t b = 0; b < mass.bodies.size(); ++b) {
    const Vector3 spin = v.segment<3>(model.frame_dof[at(model.body_frame[b])]);
    twice += spin.dot(mass.bodies[b] * spin);
  }
  return 0.5 * twice;
}

}  // namespace withe
