#include <Eigen/Eigenvalues>

#include "world/implementation.hpp"

namespace withe {

Linearisation World::linearise() const {
  Implementation& self = *implementation_;
  const Model& model = self.model;
  const Eigen::Index n = model.dof_count;
  Equations& system = self.statics();
  self.update_custom_force(system);
  system.begin(self.state, self.parameters, 0.0, false);
  system.evaluate(self.state.q, true, nullptr, self.work.newton.evaluation);
  self.reaction_current = false;

  // An orthonormal basis of what supports leave free.
  std::vector<bool> held(static_cast<std::size_t>(n), false);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(n, n);
  Eigen::Index count = 0;
  for (const Constraint& c : model.constraints) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(c.free.topLeftCorner(c.size, c.size));
    for (int i = 0; i < c.size; ++i) {
      held[static_cast<std::size_t>(c.first + i)] = true;
      if (axes.eigenvalues()(i) > 0.5) basis.col(count++).segment(c.first, c.size) = axes.eigenvectors().col(i);
    }
  }
  for (Eigen::Index i = 0; i < n; ++i)
    if (!held[static_cast<std::size_t>(i)]) basis(i, count++) = 1.0;

  Linearisation out;
  Eigen::MatrixXd product(n, count);
  for (Eigen::Index i = 0; i < count; ++i)
    system.assembler().solver().multiply({basis.col(i).data(), static_cast<std::size_t>(n)},
                                         {product.col(i).data(), static_cast<std::size_t>(n)});
  const auto B = basis.leftCols(count);
  out.stiffness = B.transpose() * product;
  VectorX column, times;
  for (Eigen::Index i = 0; i < count; ++i) {
    column = basis.col(i);
    multiply(model, system.mass(), column, times);
    product.col(i) = times;
  }
  out.mass = B.transpose() * product;
  out.displacement.setZero(3 * model.node_count, count);
  for (int node = 0; node < model.node_count; ++node)
    for (Eigen::Index i = 0; i < count; ++i)
      out.displacement.col(i).segment<3>(3 * node) = node_velocity(model, basis.col(i), node);
  return out;
}

}  // namespace withe
