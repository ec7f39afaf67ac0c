#include "model/layout.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/check.hpp"

namespace withe {

namespace {

/// Indices that follow from the places of the unknowns.
void note_places(Model& model) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  model.tail_dof.clear();
  model.head_dof.clear();
  for (int e = 0; e < model.edge_count; ++e) {
    model.tail_dof.push_back(model.node_dof[at(model.edge_tail[at(e)])]);
    model.head_dof.push_back(model.node_dof[at(model.edge_head[at(e)])]);
  }
  model.reversed_bend.clear();
  for (std::size_t b = 0; b < model.bend.size(); ++b)
    if (model.bend[b].sign[0] < 0 || model.bend[b].sign[1] < 0) model.reversed_bend.push_back(static_cast<int>(b));
}

/// Unknowns of parts that bodies carry.
void note_carried(Model& model) {
  for (CarriedPart& part : model.carried) {
    const auto add = [&](int first, int size) {
      for (int i = 0; i < size; ++i) part.body_dofs.push_back(first + i);
    };
    part.body_dofs.clear();
    if (part.is_node()) {
      part.own_dof = model.node_dof[static_cast<std::size_t>(part.node)];
      part.own_size = model.dimension;
      add(model.node_dof[static_cast<std::size_t>(part.base)], model.dimension);
      add(model.frame_dof[static_cast<std::size_t>(part.frame)], model.frame_size());
      if (part.slide >= 0) add(model.slides[static_cast<std::size_t>(part.slide)].dof, 1);
    } else if (part.edge >= 0) {
      part.own_dof = model.edge_dof[static_cast<std::size_t>(part.edge)];
      part.own_size = 1;
      add(model.frame_dof[static_cast<std::size_t>(part.frame)], model.frame_size());
    } else {
      part.own_dof = model.frame_dof[static_cast<std::size_t>(part.own_frame)];
      part.own_size = model.frame_size();
      add(model.frame_dof[static_cast<std::size_t>(part.frame)], model.frame_size());
      if (part.hinge >= 0) add(model.hinges[static_cast<std::size_t>(part.hinge)].dof, 1);
    }
  }
}

}  // namespace

void lay_out_unknowns(Model& model) {
  const auto& rods = model.description.rods;
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  int next = 0;
  model.node_dof.assign(at(model.node_count), -1);
  model.frame_dof.assign(at(model.frame_count), -1);
  if (!model.planar()) model.edge_dof.assign(at(model.edge_count), -1);
  std::vector<std::vector<int>> frames_at(at(model.node_count));
  for (int f = 0; f < model.frame_count; ++f) frames_at[at(model.frame_node[at(f)])].push_back(f);

  // Unknowns of carried parts come last. They take no part in the elimination, and would widen the band.
  std::vector<bool> waiting_node(at(model.node_count), false), waiting_frame(at(model.frame_count), false);
  for (const CarriedPart& part : model.carried) {
    if (part.is_node()) waiting_node[at(part.node)] = true;
    if (part.is_frame()) waiting_frame[at(part.own_frame)] = true;
  }
  const auto place_frames = [&](int node) {
    for (int f : frames_at[at(node)]) {
      if (!waiting_frame[at(f)]) {
        model.frame_dof[at(f)] = next;
        next += model.frame_size();
      }
      for (Hinge& hinge : model.hinges)
        if (hinge.frame == f) hinge.dof = next++;
      for (Slide& slide : model.slides)
        if (slide.frame == f) slide.dof = next++;
    }
  };
  // Bodies at points that no rod has lie beside the base of the body that carries them.
  std::vector<bool> on_rod(at(model.node_count), false), placed_node(at(model.node_count), false);
  for (const RodDescription& rod : rods)
    for (int node : rod.nodes) on_rod[at(node)] = on_rod[at(node)] || !rod.is_surface();
  std::function<void(int)> place_node_of_body;
  const auto place_carried = [&](int base) {
    for (const CarriedPart& carried : model.carried)
      if (carried.base == base && carried.is_node() && !on_rod[at(carried.node)]) place_node_of_body(carried.node);
  };
  // A frame at the far end of a rod is outside of the stencil of the node before, so that the band stays narrow.
  const auto place_node = [&](int node, bool far_end) {
    if (placed_node[at(node)]) return;
    placed_node[at(node)] = true;
    if (!far_end) {
      place_carried(node);
      place_frames(node);
    }
    if (!waiting_node[at(node)]) {
      model.node_dof[at(node)] = next;
      next += model.dimension;
    }
    if (far_end) {
      place_frames(node);
      place_carried(node);
    }
  };
  place_node_of_body = [&](int node) { place_node(node, false); };
  const auto place_rod = [&](std::size_t r) {
    const RodDescription& rod = rods[r];
    for (std::size_t i = 0; i < rod.nodes.size(); ++i) {
      place_node(rod.nodes[i], i > 0 && i + 1 == rod.nodes.size() && !rod.closed);
      const int edge = model.rod_first_edge[r] + static_cast<int>(i);
      if (edge < model.rod_first_edge[r + 1] && !model.planar()) model.edge_dof[at(edge)] = next++;
    }
  };
  std::vector<bool> placed(rods.size(), false);
  for (std::size_t r = 0; r < rods.size(); ++r) placed[r] = rods[r].is_surface();
  // A chain starts at a rod whose first node is not the end of another rod, if there is one.
  std::vector<bool> is_end(at(model.node_count), false);
  for (const RodDescription& rod : rods)
    if (!rod.closed && !rod.is_surface()) is_end[at(rod.nodes.back())] = true;
  for (bool only_heads : {true, false})
    for (std::size_t r = 0; r < rods.size(); ++r) {
      if (placed[r] || (only_heads && is_end[at(rods[r].nodes.front())])) continue;
      for (std::size_t current = r; current < rods.size();) {
        placed[current] = true;
        place_rod(current);
        const int last = rods[current].nodes.back();
        std::size_t following = rods.size();
        for (std::size_t k = 0; k < rods.size() && following == rods.size(); ++k)
          if (!placed[k] && rods[k].nodes.front() == last) following = k;
        current = following;
      }
    }
  for (int node = 0; node < model.node_count; ++node) place_node(node, false);
  for (Loop& loop : model.loops) {
    loop.dof = next;
    next += model.loop_size();
  }
  for (const CarriedPart& part : model.carried) {
    int& own = part.is_node()    ? model.node_dof[at(part.node)]
               : part.is_frame() ? model.frame_dof[at(part.own_frame)]
                                 : model.edge_dof[at(part.edge)];
    own = next;
    next += part.is_node() ? model.dimension : part.is_frame() ? model.frame_size() : 1;
  }
  model.dof_count = next;
  note_places(model);
  note_carried(model);
}

namespace {

/// Owners of held unknowns, while constraints are gathered.
class Holder {
 public:
  explicit Holder(Model& model)
      : model_(model),
        by_edge_(at(model.node_count), false),
        node_(by_edge_),
        edge_(at(model.edge_count), false),
        frame_(at(model.frame_count), false) {}

  const std::vector<bool>& nodes() const { return node_; }

  void hold(Support& support) {
    support.nodes.clear();
    support.edges.clear();
    if (!support.active || support.yields()) return;
    if (support.is_hand()) {
      for (int node : support.span) {
        if (is(node_, node) && is(by_edge_, node)) continue;  // between two held edges, the first support holds it
        hold_node(support, node);
      }
      for (const TouchedEdge& touched : support.touched) hold_edge(support, touched.edge, false);
      return;
    }
    hold_node(support, support.node);
    if (support.other_node >= 0) hold_node(support, support.other_node);
    const bool spinning = may_spin(support.description.kind);
    if (support.edge >= 0) hold_edge(support, support.edge, spinning);
    if (support.frame >= 0) hold_frame(support, spinning);
  }

 private:
  static bool is(const std::vector<bool>& held, int i) { return held[static_cast<std::size_t>(i)]; }

  void hold_node(Support& support, int node) {
    require(!is(node_, node), "node is already held: release the support that is there first");
    require(std::none_of(model_.carried.begin(), model_.carried.end(),
                         [&](const CarriedPart& carried) { return carried.node == node; }),
            "a support holds a second point of a rigid body: hold only one of its points");
    node_[at(node)] = true;
    by_edge_[at(node)] = support.is_hand() || support.other_node >= 0;
    support.nodes.push_back(node);
    const Matrix3& free = support.description.free;
    Constraint c{model_.node_dof[at(node)], model_.dimension, free};
    if (model_.planar()) {
      Eigen::Matrix<double, 3, 2> axes;
      axes << model_.plane->first, model_.plane->second;
      c.free.setZero();
      c.free.topLeftCorner<2, 2>() = axes.transpose() * free * axes;
    }
    model_.constraints.push_back(c);
  }

  void hold_edge(Support& support, int edge, bool spinning) {
    require(!is(edge_, edge), "edge is already held: release what holds it first");
    edge_[at(edge)] = true;
    if (spinning) return;
    support.edges.push_back(edge);
    if (!model_.planar()) model_.constraints.push_back({model_.edge_dof[at(edge)], 1, Matrix3::Zero()});
  }

  void hold_frame(const Support& support, bool spinning) {
    require(!is(frame_, support.frame), "joint is already clamped: release the clamp that is there first");
    require(std::none_of(model_.carried.begin(), model_.carried.end(),
                         [&](const CarriedPart& carried) { return carried.own_frame == support.frame; }),
            "a clamp holds a body on a joint of another body, which closes a loop: clamp the other body");
    frame_[at(support.frame)] = true;
    const bool turns = spinning && !model_.planar();
    const Vector3& gripped = support.description.axis;
    const Vector3 axis = gripped.isZero() ? support.tangent : gripped;
    // In a plane a body turns about the normal, or not at all.
    if (spinning && model_.planar() && std::abs(axis.dot(model_.plane->normal)) > 0.5) return;
    const Matrix3 free = turns ? Matrix3(axis * axis.transpose()) : Matrix3(Matrix3::Zero());
    model_.constraints.push_back({model_.frame_dof[at(support.frame)], model_.frame_size(), free});
  }

  Model& model_;
  std::vector<bool> by_edge_, node_, edge_, frame_;
};

}  // namespace

void add_constraints(Model& model) {
  model.constraints.clear();
  Holder holder(model);
  for (Support& support : model.supports)
    if (!support.is_hand()) holder.hold(support);
  for (Support& support : model.supports)
    if (support.is_hand()) holder.hold(support);
  const auto holds = [&](int first) {
    return std::any_of(model.constraints.begin(), model.constraints.end(),
                       [&](const Constraint& c) { return c.first == first && c.free.isZero(); });
  };
  for (CarriedPart& part : model.carried)
    part.is_held = !part.is_frame() && part.slide < 0 && holds(model.node_dof[at(part.base)]) &&
                   holds(model.frame_dof[at(part.frame)]);
  const auto held = [&](int node) { return holder.nodes()[at(node)]; };
  model.edge_lumped.clear();
  model.edge_held.clear();
  for (int e = 0; e < model.edge_count; ++e) {
    const auto i = at(e);
    model.edge_lumped.push_back(model.rod_curved[at(model.edge_rod[i])]);
    model.edge_held.push_back(held(model.edge_tail[i]) || held(model.edge_head[i]));
  }
}

}  // namespace withe
