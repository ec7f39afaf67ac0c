#pragma once
/// Elastic energy, gradient and Hessian of one stencil in its own unknowns.
///
/// Unknowns of each stencil, in this order (in space / in a plane):
///   stretch: tail, head (6 / 4); bend: node 0, angle 0, node 1, angle 1, node 2 (11 / nodes only, 6);
///   half: tail, angle, head, frame, hinge (11 / tail, head, frame, 5). A missing hinge stays zero.

#include "model/state.hpp"

namespace withe {

constexpr int kMaxLocal = 11;

/// Numbers of one stencil, or of another element with that many unknowns at most.
template <int size>
struct LocalOf {
  double energy;
  double gradient[size];
  double hessian[size][size];  ///< full
};
/// Energy, gradient and symmetric Hessian of a stencil.
using Local = LocalOf<kMaxLocal>;

/// Stiffnesses and natural strains of every stencil, as they act in one evaluation.
struct ElasticCoefficients {
  BendMeasure measure;
  VectorX stretch_stiffness;              ///< EA [N]
  VectorX stretch_natural;                ///< natural strain [-]
  Columns3 bend_stiffness, bend_natural;  ///< [N m]; natural strains f (kappa1, kappa2, tau)
  Columns3 half_stiffness, half_natural;
  VectorX joint_stiffness, joint_natural;  ///< per revolute joint [N m/rad], [rad]
};

/// Coefficients of bending and twisting of one stencil.
struct TurnCoefficients {
  BendMeasure measure;
  Vec3d stiffness, natural;
};
inline TurnCoefficients bend_coefficients(const ElasticCoefficients& k, int i) {
  return {k.measure,
          {k.bend_stiffness(i, 0), k.bend_stiffness(i, 1), k.bend_stiffness(i, 2)},
          {k.bend_natural(i, 0), k.bend_natural(i, 1), k.bend_natural(i, 2)}};
}
inline TurnCoefficients half_coefficients(const ElasticCoefficients& k, int i) {
  return {k.measure,
          {k.half_stiffness(i, 0), k.half_stiffness(i, 1), k.half_stiffness(i, 2)},
          {k.half_natural(i, 0), k.half_natural(i, 1), k.half_natural(i, 2)}};
}

/// `set_elastic` sets the coefficients of elasticity alone, `set_natural` only their natural strains.
void set_elastic(const Parameters& parameters, ElasticCoefficients& out);
void set_natural(const Parameters& parameters, ElasticCoefficients& out);
/// Kelvin-Voigt viscosity alone over an interval h: the potential (eta / E) k (s - s0)^2 / (2 h) of the
/// strain s has the form of an elastic one with natural strain s0.
void set_viscous(const Model& model, const Parameters& parameters, const Configuration& start, double h,
                 ElasticCoefficients& out);
/// The same if h is half a step that is evaluated in the middle. The resulting s0 makes s - s0 half of the change of
/// the strain in the step, (s_end - s_start) / 2. The strains at the midpoint of the chord differ from those on the
/// path, even if a rod only rotates. A rate from these strains would cause a spurious force and add energy.
void refer_viscous_to_ends(const Model& model, const Configuration& start, const Configuration& middle,
                           const Configuration& end, ElasticCoefficients& out);
/// Sum of two quadratic energies in the strains, up to a constant.
void add_coefficients(const ElasticCoefficients& other, ElasticCoefficients& sum);

void stretch_local(const Model& model, const ElasticCoefficients& coefficients, const Configuration& c, int edge,
                   bool with_hessian, const double* axial_force, Local& out);
void bend_local(const Model& model, const TurnCoefficients& coefficients, const Configuration& c, int stencil,
                bool with_hessian, Local& out);
void half_local(const Model& model, const VectorX& q, const TurnCoefficients& coefficients, const Configuration& c,
                int stencil, bool with_hessian, Local& out);

/// The strains of one stencil, f (kappa1, kappa2, tau) (in a plane the first alone), or the axial strain of an edge;
/// and their gradients, a row each.
struct StrainGradients {
  int count;
  double strain[3];
  double gradient[3][kMaxLocal];
};
void stretch_gradients(const Model& model, const Configuration& c, int edge, StrainGradients& out);
void bend_gradients(const Model& model, const BendMeasure& measure, const Configuration& c, int stencil,
                    StrainGradients& out);
void half_gradients(const Model& model, const VectorX& q, const BendMeasure& measure, const Configuration& c,
                    int stencil, StrainGradients& out);

/// Energies alone: stretch of an edge; bend and twist of a stencil [J].
double stretch_energy_of(const Model& model, const ElasticCoefficients& coefficients, const Configuration& c, int edge);
struct BendTwistEnergy {
  double bend, twist;
};
BendTwistEnergy bend_energy_of(const ElasticCoefficients& coefficients, const Configuration& c, int stencil);
BendTwistEnergy half_energy_of(const ElasticCoefficients& coefficients, const Configuration& c, int stencil);
/// Growth of the energy if the strains remain and the natural strains become those of the parameters [J]. Per stencil
/// it is k (n1 - n0) ((n0 + n1) / 2 - s), without the rounding errors of two energies.
double natural_change_energy(const Model& model, const ElasticCoefficients& coefficients, const Parameters& now,
                             const Configuration& c);

}  // namespace withe
