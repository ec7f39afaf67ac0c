// Forces of the energy-momentum scheme: see equations.hpp and elasticity/discrete_elements.hpp.

#include "elasticity/discrete_elements.hpp"
#include "integrators/equations.hpp"

namespace withe {

/// Axial forces of the mean strain.
void Equations::set_mean_axial_forces() {
  const int n = model_.edge_count;
  force_.resize(n);
  modulus_.resize(n);
  for (int e = 0; e < n; ++e) {
    const MeanStretch mean = mean_stretch(model_, elastic, start_, end_, e);
    force_[e] = mean.force;
    modulus_[e] = mean.modulus;
  }
}

void Equations::add_discrete_gradient(const VectorX& z, bool with_matrix, const double* axial_force, Evaluation& out) {
  const std::span<double> values = assembler_.solver().values();
  const DiscreteStep step{start_, middle_, end_, end_q_, difference_};
  Local local;
  const auto add = [&](const ElementTable& table, int i) {
    table.add_gradient(i, local.gradient, 1.0, gradient_, magnitude_);
    if (with_matrix) table.add_hessian(i, local.hessian, 1.0, values);
  };
  set_mean_axial_forces();
  const StencilKernels& kernels = stencil_kernels();
  (model_.planar() ? kernels.planar_momentum_bend : kernels.momentum_bend)(
      regular_batch(elastic, axial_force, with_matrix ? values.data() : nullptr),
      {.start_frames = &start_.edge.data()->tangent.x,
       .end_frames = &end_.edge.data()->tangent.x,
       .start_strain = start_.bend_strain.data(),
       .end_strain = end_.bend_strain.data()});
  for (int e : assembler_.regular.other_edges) {
    discrete_stretch_local(model_, elastic, step, e, with_matrix, axial_force, local);
    add(assembler_.stretch, e);
  }
  for (int b : assembler_.regular.other_bend) {
    discrete_bend_local(model_, elastic, step, b, with_matrix, local);
    add(assembler_.bend, b);
  }
  for (int h = 0; h < static_cast<int>(model_.half.size()); ++h) {
    discrete_half_local(model_, elastic, step, h, with_matrix, local);
    add(assembler_.half, h);
  }
  elastic_rows_ = gradient_.head(model_.dof_count);
  if (!parameters_->viscous || h_ == 0.0) return;
  add_elastic(viscous_, z, with_matrix, nullptr, out);
}

}  // namespace withe
