#include "gradients/state_vector.hpp"

#include <algorithm>
#include <vector>

#include <Eigen/Eigenvalues>

#include "common/check.hpp"
#include "geometry/rotation.hpp"

namespace withe {

SparseMatrix free_basis(const Model& model) {
  std::vector<bool> held(at(model.dof_count), false);
  std::vector<Eigen::Triplet<double>> entries;
  int count = 0;
  for (const CarriedPart& part : model.carried)  // they follow their bodies
    std::fill_n(held.begin() + part.own_dof, part.own_size, true);
  for (const Constraint& c : model.constraints) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(c.free.topLeftCorner(c.size, c.size));
    for (int i = 0; i < c.size; ++i) {
      held[at(c.first + i)] = true;
      if (axes.eigenvalues()(i) <= 0.5) continue;
      for (int k = 0; k < c.size; ++k) entries.emplace_back(c.first + k, count, axes.eigenvectors()(k, i));
      ++count;
    }
  }
  for (int i = 0; i < model.dof_count; ++i)
    if (!held[at(i)]) entries.emplace_back(i, count++, 1.0);
  SparseMatrix out(model.dof_count, count);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

VectorX state_difference(const Model& model, const State& reference, const State& state) {
  VectorX q = state.q - reference.q;
  if (!model.planar()) {
    Configuration from, to;
    compute_configuration(model, reference, reference.q, from);
    compute_configuration(model, state, state.q, to);
    for (int e = 0; e < model.edge_count; ++e) {
      const EdgeFrame<double>&a = from.edge[at(e)], &b = to.edge[at(e)];
      q(model.edge_dof[at(e)]) = signed_angle(parallel_transport(a.d1, a.tangent, b.tangent), b.d1, b.tangent);
    }
    for (int f = 0; f < model.frame_count; ++f)
      q.segment<3>(model.frame_dof[at(f)]) = cayley_inverse(to.frame[at(f)] * from.frame[at(f)].transpose());
  }
  const SparseMatrix back = free_basis(model).transpose();
  VectorX out(2 * back.rows());
  out << back * q, back * (state.v - reference.v);
  return out;
}

void displace_state(const Model& model, const VectorX& by, State& state) {
  const SparseMatrix basis = free_basis(model);
  require(by.size() == 2 * basis.cols(), "a displacement of the state has " + std::to_string(2 * basis.cols()) +
                                             " numbers, got " + std::to_string(by.size()));
  require(by.allFinite(), "a displacement of the state must be finite");
  State out = state;
  Configuration configuration;
  if (!model.planar()) {  // frames count from their present orientation
    compute_configuration(model, out, out.q, configuration);
    accept_configuration(model, VectorX(out.q), configuration, out);
  }
  const VectorX q = out.q + basis * by.head(basis.cols());
  compute_configuration(model, out, q, configuration);
  require(configuration.length.minCoeff() > 0.0 && configuration.bend_strain.allFinite() &&
              configuration.half_strain.allFinite(),
          "the displacement of the state must not fold an edge back onto the next or "
          "give an edge zero length");
  accept_configuration(model, q, configuration, out);
  out.v += basis * by.tail(basis.cols());
  state = std::move(out);
}

}  // namespace withe
