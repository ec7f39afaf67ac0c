#include "steps/strain_parts.hpp"

#include <cmath>
#include <limits>
#include <span>

#include "steps/joint_forces.hpp"

namespace withe {
namespace {

void take_away(double strain, double& stiffness, double& natural) {
  constexpr double kLittle = 0x1p-40;
  natural = strain - (strain - natural) / kLittle;
  stiffness *= kLittle;
}

std::span<const double> view(const VectorX& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }
std::span<double> view(VectorX& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

}  // namespace

StrainParts::StrainParts(const Equations& system, const State& state, const Configuration& configuration)
    : without_(system.elastic()) {
  const Model& model = system.model();
  const ElasticCoefficients& k = system.elastic();
  const Assembler& assembler = system.assembler();
  StrainGradients strains;
  for (int e = 0; e < model.edge_count; ++e) {
    if (k.stretch_stiffness(e) == 0.0) continue;
    stretch_gradients(model, configuration, e, strains);
    add_row(assembler.stretch, e, strains.gradient[0], k.stretch_stiffness(e) * model.edge_length(e));
    take_away(strains.strain[0], without_.stretch_stiffness(e), without_.stretch_natural(e));
  }
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    bend_gradients(model, k.measure, configuration, b, strains);
    add_rows(assembler.bend, b, strains, k.bend_stiffness, without_.bend_stiffness, without_.bend_natural);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    half_gradients(model, state.q, k.measure, configuration, h, strains);
    add_rows(assembler.half, h, strains, k.half_stiffness, without_.half_stiffness, without_.half_natural);
  }
  for (int j = 0; j < static_cast<int>(model.joint_angles.size()); ++j) {
    const JointAngle& joint = model.joint_angles[at(j)];
    if (!joint.turns() || k.joint_stiffness(j) == 0.0) continue;
    if (joint_torque(model, *system.problem().parameters, k, j).is_saturated(joint.angle(state.q))) continue;
    const auto row = static_cast<int>(stiffnesses_.size());
    gradients_.emplace_back(row, joint.turning, 1.0);
    if (joint.against >= 0) gradients_.emplace_back(row, joint.against, -1.0);
    stiffnesses_.push_back(k.joint_stiffness(j));
    take_away(joint.angle(state.q), without_.joint_stiffness(j), without_.joint_natural(j));
  }
}

void StrainParts::add_row(const ElementTable& table, int element, const double* gradient, double stiffness) {
  const int row = static_cast<int>(stiffnesses_.size());
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i)
    if (dofs[i] >= 0 && gradient[i] != 0.0) gradients_.emplace_back(row, dofs[i], gradient[i]);
  stiffnesses_.push_back(stiffness);
}

void StrainParts::add_rows(const ElementTable& table, int stencil, const StrainGradients& strains,
                           const Columns3& stiffness, Columns3& less, Columns3& shifted) {
  for (int s = 0; s < strains.count; ++s) {
    if (stiffness(stencil, s) != 0.0) add_row(table, stencil, strains.gradient[s], stiffness(stencil, s));
    take_away(strains.strain[s], less(stencil, s), shifted(stencil, s));
  }
}

Curvature curvature_along(Equations& system, const State& state, const VectorX& direction, StepData& scratch) {
  constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();
  system.evaluate(state.q, false, nullptr, scratch);
  const StrainParts parts(system, state, scratch.configuration);
  const ElasticCoefficients whole = system.elastic();
  system.elastic() = parts.without();
  system.evaluate(state.q, true, nullptr, scratch);
  system.elastic() = whole;
  Curvature out;
  // Parts that bodies carry follow them. The matrix has their forces in the rows of the bodies.
  VectorX moved = direction, own = direction;
  system.expand(scratch, moved);
  for (const CarriedPart& part : system.model().carried) own.segment(part.own_dof, part.own_size).setZero();
  VectorX image(direction.size());
  VectorX size = own.cwiseAbs();
  LinearSolver& rest = system.assembler().solver();
  rest.multiply(view(own), view(image));
  out.value = own.dot(image);
  for (double& entry : rest.values()) entry = std::abs(entry);
  rest.multiply(view(size), view(image));
  out.rounding = size.dot(image);
  size = moved.cwiseAbs();
  const auto count = static_cast<Eigen::Index>(parts.stiffnesses().size());
  VectorX strain = VectorX::Zero(count), greatest = VectorX::Zero(count);
  for (const Eigen::Triplet<double>& g : parts.gradients()) {
    strain(g.row()) += g.value() * moved(g.col());
    greatest(g.row()) += std::abs(g.value()) * size(g.col());
  }
  const Eigen::Map<const VectorX> k(parts.stiffnesses().data(), count);
  out.value += strain.cwiseAbs2().dot(k);
  out.rounding += strain.cwiseAbs().cwiseProduct(greatest).dot(k);
  out.rounding *= kRounding;
  return out;
}

}  // namespace withe
