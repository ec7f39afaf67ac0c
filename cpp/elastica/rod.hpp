#pragma once
/// The suspended part of a rod in space: a heavy elastic rod that leaves a flat floor and is held by a gripper.
///
/// Units are the gravito-bending length Lgb = (EI / 2w)^(1/3) and the weight per length w, so that EI = 2. The lift-off
/// point is the origin, the rod leaves it along x, and z is up. The variables are the arc length s of the unstretched
/// rod from the origin, the tangent t and the moment m. F is the force of the floor on the rod, and n the force that
/// the part beyond s applies to the part before s:
///   t' = m x t / 2,  m' = -(1 + e) t x n,  n = -F + s z,  e = n.t / EA,  r' = (1 + e) t,
///   t(0) = x,  m(0) = -2 kappa z,  r(0) = 0.
/// The curvature kappa lies in the plane of the floor, and kappa > 0 bends towards -y. The curvature across this plane
/// is zero, because a floor applies no moment about y. The twist is zero everywhere: m.t is constant along a rod whose
/// section has equal bending stiffness in all directions.
///
/// A thick rod rests on its surface, and F acts at a lever r below its centreline. Then
///   m(0) = r (F_x y - F_y x) + (b F_y - 2 kappa) z,
/// and m.t = -r F_y twists the whole suspended part. The lying part may roll, and moves sideways by y = -r phi, where
/// phi is its rotation about its axis. Transverse friction f bends it, EI y'''' = f, and rotates it, GJ phi'' = -r f.
/// Hence y'''' = y'' / b^2 with b = r sqrt(EI / GJ). F_y is distributed behind lift-off as exp(-s / b), so its
/// resultant acts at a distance b behind.
/// [Kirchhoff's rod with stretch; dissertation (9.1) and the parts of (9.3) that apply here.]

#include <array>
#include <vector>

#include "elastica/shooting.hpp"

namespace withe {

using RodVector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  ///< w, x, y, z
Quaternion product(const Quaternion& a, const Quaternion& b);

constexpr double kRodBendStiffness = 2.0;  ///< EI [w Lgb^2]

/// Condition at the held end, and which two of the floor's three forces are unknown for it.
enum class RodEnd {
  no_moment,    ///< a gripper that exerts no moment; F along y and z
  plane_of_xz,  ///< position along x and z; F along x and z
};

/// States t, m, and the position r if `end` requires it.
template <RodEnd end>
class RodProblem {
 public:
  static constexpr int kCoupled = 6, kParameters = 2;
  static constexpr int kStates = end == RodEnd::no_moment ? kCoupled : kCoupled + 3;
  using Path = ShootingPath<kStates, kParameters>;
  using System = ShootingSystem<kStates, kParameters>;

  double stretch_stiffness = 1e9;  ///< EA [w Lgb]
  double given_force = 0;          ///< the third component of F
  double lever = 0;                ///< distance of F below the centreline [Lgb]
  double behind = 0;               ///< b: how far behind lift-off F_y acts [Lgb]
  std::array<double, 2> goal{};    ///< required position
  std::vector<double> cuts;        ///< s of each node; the last one is the suspended length

  RodVector floor_force(const Path& path) const;
  double twist(const Path& path) const { return -lever * floor_force(path)[1]; }  ///< m.t
  void linearise(const Path& path, System& system) const;
  /// Computes only the gaps. The slopes along the rod do not change.
  void put_gaps(const Path& path, System& system) const;

 private:
  template <class Put>
  void for_blocks(const Path& path, const Put& put) const;
  double gap(const Path& path, std::size_t segment, int i, double ends) const;
  void put_end(const Path& path, System& system) const;
};

/// Cuts no further apart than 0.6 Lgb, over which no error grows by more than twenty times up to a length of 50.
std::vector<double> rod_cuts(double suspended);

/// A point of a solved rod.
struct RodPoint {
  RodVector tangent{}, moment{}, position{};
  Quaternion rotation{1, 0, 0, 0};  ///< rotation relative to the frame at lift-off
};

/// Everything that a solved path implies, by one more pass along it.
struct RodShape {
  double suspended = 0, stretch_stiffness = 1e9;
  RodVector floor_force{};
  std::vector<double> places;    ///< s of the points
  std::vector<RodPoint> points;  ///< `spread` points per segment of the path, including the cuts
  double twist = 0;              ///< m.t, which the points' rotations do not show: they are transported in parallel
  double residual = 0;           ///< largest gap at a cut or at the end
  double lowest = 0;             ///< least height of the points
};
template <RodEnd end>
RodShape rod_shape(const RodProblem<end>& problem, const typename RodProblem<end>::Path& path, int spread);

extern template class RodProblem<RodEnd::no_moment>;
extern template class RodProblem<RodEnd::plane_of_xz>;

}  // namespace withe
