#pragma once
/// Forces and moments that joints of rigid bodies transmit.
///
/// A step balances the rows of all parts that meet at a joint. The rows of one of these parts alone are its momentum
/// per time without the other forces on it: the force and the moment of the joint on this part. Rows of a body are
/// those of everything that it carries. The parts are the bodies of a joint and, as one, its rods.
///
/// A body has its own rows if the joint is at its base. Every other body at a joint carries the others, so that its
/// wrench is minus the sum of theirs.

#include <vector>

#include "steps/step_problem.hpp"

namespace withe {

/// A part at a joint: a body, or the rods of a cluster.
struct JointPart {
  int body = -1;                ///< -1: rods
  std::vector<RodPass> passes;  ///< of rods
};
/// Parts at a joint, in the order of its clusters, the body of a cluster first. Empty at a joint without a body.
std::vector<JointPart> parts_of(const JointDescription& joint);
/// Body along whose axis the other part of a sliding joint moves.
int carrier_of_slide(const SceneDescription& scene, const JointDescription& joint);
/// Row of the node where the parts of a joint meet.
int node_of_parts(const Model& model, const std::vector<JointPart>& parts);

class JointWrenches {
 public:
  explicit JointWrenches(const Model& model);

  /// True if a joint has a body.
  bool any() const { return !places_.empty(); }
  /// Sets the wrench on each part of each joint, about the node of the joint, one joint after the other. The force on
  /// all rods of a joint is that of its first part of rods.
  void find(const StepProblem& problem, const Assembler& assembler, StepData& data) const;

 private:
  struct Part {
    int body = -1;
    bool at_base = false;      ///< true if the base of the body is at the joint
    bool at_center = false;    ///< true if the centre of mass of the body is there
    std::vector<int> carried;  ///< carried nodes of the body, if its base is there
    std::vector<int> half;     ///< stencils of rods at the joint
  };
  struct Place {
    int node = 0;
    std::vector<Part> parts;
    std::vector<int> joints;  ///< numbers of revolute joints
  };

  std::vector<Place> places_;
};

}  // namespace withe
