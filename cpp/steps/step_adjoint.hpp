#pragma once
/// Derivatives of a step by its input, times a vector. The adjoint method needs them of each term.

#include <map>

#include "model/parameter_index.hpp"
#include "model/state.hpp"

namespace withe {

/// One row per hand: along and about its axes.
using MatrixX6 = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

/// Derivatives of a scalar by the coefficients of a step's equations.
struct CoefficientAdjoint : PartNumbers {
  VectorX stretch_stiffness, stretch_time;  ///< per edge: by EA [1/N] and by viscous time [1/s]
  VectorX stretch_natural;                  ///< per edge, by the natural strain
  Columns3 bend_stiffness, bend_natural;    ///< per stencil: by stiffnesses [1/(N m)], by natural strains
  Columns3 half_stiffness, half_natural;
  VectorX bend_time, half_time;                      ///< by viscous times [1/s]
  VectorX mass, mass_coupling, drag, drag_coupling;  ///< by `MassMatrix`
  VectorX gravity;                                   ///< per unknown, by its force [1/N]
  MatrixX3 loads;                                    ///< by `Parameters::loads`
  VectorX edge_mass;                                 ///< by line density times length, only through contacts
  double gravity_size = 0;                           ///< by the magnitude of gravity, only through contacts [s^2/m]
  double fluid_viscosity = 0;                        ///< [1/(Pa s)]
  double friction = 0, slip_tolerance = 0;           ///< by the values of the scene [-], [s/m]
  MatrixX3 obstacle_friction, pair_friction;         ///< per obstacle, per pair of bodies [-]
  VectorX obstacle_rolling;                          ///< per obstacle [-]
  MatrixX6 hand_stiffness;                           ///< per support, see `HandDescription` [m/N], [rad/(N m)]
  VectorX hand_limit;                                ///< per support [1/N]
  std::vector<MatrixX2> natural_curvature;  ///< per rod and stencil, by the smooth curvature, through read-outs [m]
  VectorX rest_length;                      ///< per edge, through axial strain, loads along rods and read-outs [1/m]
  /// Derivatives by rotation vectors in the axes of the drawn scene [1/rad]. `attachment` is per half stencil, by the
  /// rotation of the part that is attached to its frame. `edge_turn` is per edge, by its frame in the drawing, without
  /// the effects through the members above.
  MatrixX3 attachment, edge_turn;
  MatrixX2 planar_components;  ///< per rod, by `Model::planar_components`

  explicit CoefficientAdjoint(const Model& model, Eigen::Index load_rows)
      : PartNumbers(zero_numbers(model)),
        stretch_stiffness(VectorX::Zero(model.edge_count)),
        stretch_time(stretch_stiffness),
        stretch_natural(stretch_stiffness),
        bend_stiffness(Columns3::Zero(static_cast<Eigen::Index>(model.bend.size()), 3)),
        bend_natural(bend_stiffness),
        half_stiffness(Columns3::Zero(static_cast<Eigen::Index>(model.half.size()), 3)),
        half_natural(half_stiffness),
        bend_time(VectorX::Zero(bend_stiffness.rows())),
        half_time(VectorX::Zero(half_stiffness.rows())),
        mass(VectorX::Zero(model.dof_count)),
        mass_coupling(VectorX::Zero(model.edge_count)),
        drag(mass),
        drag_coupling(mass_coupling),
        gravity(mass),
        loads(MatrixX3::Zero(load_rows, 3)),
        edge_mass(stretch_stiffness),
        obstacle_friction(rows_of_three(model.description.contact.obstacles.size())),
        pair_friction(rows_of_three(model.description.contact.pairs.size())),
        obstacle_rolling(VectorX::Zero(obstacle_friction.rows())),
        hand_stiffness(MatrixX6::Zero(static_cast<Eigen::Index>(model.supports.size()), 6)),
        hand_limit(VectorX::Zero(static_cast<Eigen::Index>(model.supports.size()))),
        rest_length(VectorX::Zero(model.edge_count)),
        attachment(MatrixX3::Zero(half_stiffness.rows(), 3)),
        edge_turn(MatrixX3::Zero(model.edge_count, 3)),
        planar_components(rows_of_two(model.planar_components.size())) {
    for (const auto& places : model.place) natural_curvature.push_back(rows_of_two(places.size()));
  }

 private:
  static MatrixX2 rows_of_two(std::size_t count) { return MatrixX2::Zero(static_cast<Eigen::Index>(count), 2); }
  static MatrixX3 rows_of_three(std::size_t count) { return MatrixX3::Zero(static_cast<Eigen::Index>(count), 3); }
};

/// Derivatives of a scalar by the poses of hands, and by the slips of edges in yielding hands.
struct HandAdjoint {
  MatrixX3 positions, rotations;  ///< per support, the latter by a rotation vector [1/m], [1/rad]
  MatrixX3 slips;                 ///< per held edge, in the order of hands [1/m]

  HandAdjoint() = default;
  explicit HandAdjoint(const Model& model)
      : positions(MatrixX3::Zero(static_cast<Eigen::Index>(model.supports.size()), 3)), rotations(positions) {
    Eigen::Index held = 0;
    for (const Support& s : model.supports)
      if (s.active && s.yields()) held += static_cast<Eigen::Index>(s.touched.size());
    slips = MatrixX3::Zero(held, 3);
  }
  void add(const HandAdjoint& other) {
    positions += other.positions;
    rotations += other.rotations;
    slips += other.slips;
  }
};

/// Derivatives of a scalar by the stored speeds of approach of contacts [s/m].
using ApproachAdjoint = std::map<ContactKey, double>;

/// rows^T times the derivatives of a step's residual, at fixed z. The frames of edges and joints depend on the start:
/// derivatives by them are taken by their rotations, in the configuration to which they belong.
struct StepAdjoint {
  /// Multipliers of the residual. The rows of frames in space are moments: for these, multipliers of J^T times the
  /// moment.
  const VectorX& rows;
  VectorX start, velocity;       ///< by q0 (for its angles: by angles of directors) and v0
  VectorX acceleration;          ///< by the acceleration of supported unknowns; undefined for others
  VectorX start_turn, end_turn;  ///< per edge: by the angle of its directors at the start, at q1 [rad]
  VectorX middle_turn;  ///< per edge: by the angle of its directors at z, of numbers that are no part of the residual
  MatrixX3 start_spin, middle_spin, end_spin;  ///< per frame: by its rotation vector at the start, at z, at q1 [rad]
  const ApproachAdjoint& approach_after;       ///< by the stored approach at the end
  ApproachAdjoint approach;                    ///< by the stored approach at the start
  const HandAdjoint& hands_after;              ///< by slips at the end
  HandAdjoint hands, hands_end;                ///< by hands at the start, and by their poses at the end
  /// Per obstacle, by its position at the start and at the end, in the axes of the unknowns [1/m].
  MatrixX3 obstacles, obstacles_end;
  CoefficientAdjoint& coefficients;

  StepAdjoint(const Model& model, const VectorX& rows_of, const ApproachAdjoint& by_approach,
              const HandAdjoint& by_hands, CoefficientAdjoint& by)
      : rows(rows_of),
        start(VectorX::Zero(model.dof_count)),
        velocity(start),
        acceleration(start),
        start_turn(VectorX::Zero(model.edge_count)),
        end_turn(start_turn),
        middle_turn(start_turn),
        start_spin(MatrixX3::Zero(model.frame_count, 3)),
        middle_spin(start_spin),
        end_spin(start_spin),
        approach_after(by_approach),
        hands_after(by_hands),
        hands(model),
        hands_end(model),
        obstacles(MatrixX3::Zero(static_cast<Eigen::Index>(model.description.contact.obstacles.size()), 3)),
        obstacles_end(obstacles),
        coefficients(by) {}
};

}  // namespace withe
