#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/check.hpp"
#include "geometry/curvature.hpp"
#include "geometry/rotation.hpp"
#include "model/drawn_frame.hpp"
#include "model/edge_vectors.hpp"
#include "model/hands.hpp"
#include "model/layout.hpp"
#include "model/model.hpp"

namespace withe {
namespace {

using Key = std::pair<int, int>;  // rod, node within the rod

/// Rods that meet rigidly at one node.
struct Cluster {
  std::vector<RodPass> passes;
  int joint = -1;
  JointForm form = JointForm::frame;
  int frame = -1;
  int hinge = -1;
  int body = -1;
  int merged_into = -1;  ///< of a planar hinge that cannot turn: the cluster that has its rods now
};

/// Place of a revolute link, before frames have unknowns.
struct LinkPlace {
  int parent, child;  ///< clusters; the child turns, in space about the hinge
  double sign;        ///< sign of its unknown
  int hinge = -1;
  bool turns = true;
  int slide = -1;
  JointStops stops;
};

VectorX to_vector(const std::vector<double>& v) {
  return Eigen::Map<const VectorX>(v.data(), static_cast<Eigen::Index>(v.size()));
}

/// Solution d of d (1 + r) = log((1 + d) / (1 - r d)) for a restitution r, see forces/joint.hpp.
double impact_loss(double restitution) {
  constexpr double kLeast = 0.01;
  if (restitution == 1.0) return 0.0;
  const double r = std::max(restitution, kLeast);
  double low = 0.0, high = 1.0 / r;
  for (int i = 0; i < 200; ++i) {
    const double d = 0.5 * (low + high);
    // The logarithm grows faster from the root on.
    (d * (1.0 + r) > std::log1p(d) - std::log1p(-r * d) ? low : high) = d;
  }
  return 0.5 * (low + high);
}

class Builder {
 public:
  explicit Builder(Model& model) : model_(model), scene_(model.description) {}

  void build() {
    add_edges();
    find_clusters();
    add_bodies();
    add_loops();
    model_.shortest_length = shortest_length();
    add_frames();
    add_stencils();
    resolve_supports();
    share_bending();
    lay_out_unknowns(model_);
    find_joint_angles();
    add_constraints(model_);
    find_components();
    draw();
  }

 private:
  const RodDescription& rod(int r) const { return scene_.rods[static_cast<std::size_t>(r)]; }
  int edges_of(int r) const { return static_cast<int>(rod(r).nodes.size()) - (rod(r).closed ? 0 : 1); }
  int first_edge(int r) const { return model_.rod_first_edge[static_cast<std::size_t>(r)]; }
  int global_node(RodPass pass) const { return node_row(scene_, pass); }
  int node_of(const Cluster& cluster) const {
    return cluster.passes.empty() ? scene_.bodies[at(cluster.body)].node : global_node(cluster.passes.front());
  }
  EdgesAtNode edges_at(RodPass pass) const { return edges_at_node(rod(pass.rod), first_edge(pass.rod), pass.node); }
  EdgeFrame<double> strain_frame(int edge, int sign) const {
    const Matrix3 f = drawn_edge_frame(model_, edge);
    const double s = sign;
    return {to_vec3(s * f.col(2)), to_vec3(f.col(0)), to_vec3(s * f.col(1)), 1.0, {}, {}};
  }

  void add_edges() {
    model_.node_count = static_cast<int>(scene_.positions.rows());
    model_.rod_first_edge = {0};
    std::vector<double> lengths, arcs;
    double longest = 0.0;
    for (std::size_t r = 0; r < scene_.rods.size(); ++r) {
      const RodDescription& d = scene_.rods[r];
      const int count = static_cast<int>(d.nodes.size()) - (d.closed ? 0 : 1);
      double turn = 0.0;
      for (int e = 0; e < count; ++e) {
        const int tail = d.nodes[static_cast<std::size_t>(e)];
        const int head = d.nodes[static_cast<std::size_t>(e + 1) % d.nodes.size()];
        const Vector3 t = (scene_.positions.row(head) - scene_.positions.row(tail)).normalized();
        Vector3 director = d.directors.row(e);
        director = (director - t * t.dot(director)).normalized();
        model_.edge_tail.push_back(tail);
        model_.edge_head.push_back(head);
        model_.edge_rod.push_back(static_cast<int>(r));
        model_.initial_tangent.push_back(to_vec3(t));
        model_.initial_director.push_back(to_vec3(director));
        lengths.push_back(d.rest_lengths(e));
        arcs.push_back(d.arc_lengths.size() > 0 ? d.arc_lengths(e) : d.rest_lengths(e));
        turn += std::sqrt(square_of_turn(lengths.back(), arcs.back()));
      }
      model_.rod_curved.push_back(turn > 1.0);
      longest = std::max(longest, d.rest_lengths.sum());
      model_.rod_first_edge.push_back(static_cast<int>(lengths.size()));
    }
    model_.edge_count = static_cast<int>(lengths.size());
    model_.edge_length = to_vector(lengths);
    model_.edge_arc = to_vector(arcs);
    for (std::size_t r = 0; r < scene_.rods.size(); ++r) model_.rod_voronoi.push_back(voronoi_of(static_cast<int>(r)));
    model_.length_scale = longest;
    if (!model_.planar()) return;
    for (std::size_t r = 0; r < scene_.rods.size(); ++r) {
      const Matrix3 f = drawn_edge_frame(model_, model_.rod_first_edge[r]);
      const Vector3& n = model_.plane->normal;
      model_.planar_components.emplace_back(f.col(1).dot(n), -f.col(0).dot(n));
    }
  }

  /// Shortest length of an edge of a rod, else the length scale.
  double shortest_length() const {
    double shortest = INFINITY;
    for (int e = 0; e < model_.edge_count; ++e)
      if (!model_.is_surface(e)) shortest = std::min(shortest, model_.edge_length(e));
    return std::isfinite(shortest) ? shortest : model_.length_scale;
  }

  /// Half of both edges of every stencil of a rod.
  VectorX voronoi_of(int index) const {
    const auto r = static_cast<std::size_t>(index);
    const int first = model_.rod_first_edge[r], edges = model_.rod_first_edge[r + 1] - first;
    const VectorX arcs = model_.edge_arc.segment(first, edges);
    if (!scene_.rods[r].closed) return 0.5 * (arcs.head(edges - 1) + arcs.tail(edges - 1));
    VectorX out(edges);
    for (int e = 0; e < edges; ++e) out(e) = 0.5 * (arcs((e + edges - 1) % edges) + arcs(e));
    return out;
  }

  void find_clusters() {
    for (std::size_t j = 0; j < scene_.joints.size(); ++j) {
      const JointDescription& joint = scene_.joints[j];
      const int base = static_cast<int>(clusters_.size());
      for (std::size_t c = 0; c < joint.clusters.size(); ++c) {
        const std::vector<RodPass>& passes = joint.clusters[c];
        clusters_.push_back({passes, static_cast<int>(j), joint.form});
        clusters_.back().body = joint.body_of(c);
        for (const RodPass& pass : passes) cluster_of_[{pass.rod, pass.node}] = static_cast<int>(clusters_.size()) - 1;
      }
      add_links(joint, base);
    }
  }

  void add_links(const JointDescription& joint, int base) {
    if (joint.links.empty()) return;
    if (joint.links.front().slides) return add_slide(joint, base);
    if (model_.planar()) return add_planar_links(joint, base);
    const int root = root_of(joint, base);
    for (const JointLink& link : joint.links) {
      const bool swapped = base + link.child == root;
      const int turning = base + (swapped ? link.parent : link.child);
      Cluster& cluster = clusters_[at(turning)];
      const int hinge = static_cast<int>(model_.hinges.size());
      if (cluster.body < 0) cluster.hinge = hinge;  // a body on a hinge keeps its own frame
      hinged_body_.push_back(cluster.body);
      model_.hinges.push_back({-1, link.axis.normalized(), -1});
      hinge_parent_.push_back(root);
      links_.push_back({root, turning, swapped ? -1.0 : 1.0, hinge, true, -1, link.stops});
    }
  }

  /// The turning cluster of a slide: of two bodies that which the other one carries, else that of rods.
  void add_slide(const JointDescription& joint, int base) {
    const JointLink& link = joint.links.front();
    require(joint.links.size() == 1, "a sliding joint must be the only joint at its point");
    const int parent_body = joint.body_of(at(link.parent)), child_body = joint.body_of(at(link.child));
    require(parent_body >= 0 || child_body >= 0, "a sliding joint must slide on a body");
    const bool swapped = parent_body < 0 || (child_body >= 0 && scene_.bodies[at(parent_body)].carrier == child_body);
    const int root = base + (swapped ? link.child : link.parent), moving = base + (swapped ? link.parent : link.child);
    const int slide = static_cast<int>(model_.slides.size());
    model_.slides.push_back({-1, link.axis.normalized(), -1});
    slide_places_.push_back({root, moving});
    links_.push_back({root, moving, swapped ? -1.0 : 1.0, -1, true, slide, link.stops});
  }

  /// In a plane, a hinge lies between two frames. A hinge about an axis in the plane cannot turn, so its clusters are
  /// merged first.
  void add_planar_links(const JointDescription& joint, int base) {
    const auto along = [&](const JointLink& link) { return link.axis.normalized().dot(model_.plane->normal); };
    const auto now = [&](int cluster) {
      int out = base + cluster;
      while (clusters_[at(out)].merged_into >= 0) out = clusters_[at(out)].merged_into;
      return out;
    };
    for (const JointLink& link : joint.links)
      if (std::abs(along(link)) < 0.5) merge(now(link.parent), now(link.child));
    for (const JointLink& link : joint.links) {
      const int parent = now(link.parent), child = now(link.child);
      links_.push_back({parent, child, along(link) < 0.0 ? -1.0 : 1.0, -1, parent != child, -1, link.stops});
    }
  }

  /// The cluster that all others at a node turn against in space; of two that which is clamped, else the first.
  int root_of(const JointDescription& joint, int base) const {
    const auto in_all = [&](int cluster) {
      return std::all_of(joint.links.begin(), joint.links.end(),
                         [&](const JointLink& link) { return link.parent == cluster || link.child == cluster; });
    };
    const JointLink& first = joint.links.front();
    for (std::size_t c = 0; c < joint.clusters.size(); ++c)
      if (joint.body_of(c) >= 0 && !is_carried(joint, joint.body_of(c))) {
        require(in_all(static_cast<int>(c)), "rods at a point of a body must be joined to the body");
        return base + static_cast<int>(c);
      }
    if (joint.links.size() == 1 && is_clamped(base + first.child) && !is_clamped(base + first.parent))
      return base + first.child;
    for (int cluster : {first.parent, first.child})
      if (in_all(cluster)) return base + cluster;
    const auto name = [&](int cluster) {
      return "'" + rod(clusters_[at(base + cluster)].passes.front().rod).name + "'";
    };
    throw std::invalid_argument("revolute joints at one node must all turn against the same rod: where " +
                                name(first.parent) + " and " + name(first.child) +
                                " are joined, join each of the rods to one of them");
  }

  /// True if a body is on a hinge of another body of the joint.
  bool is_carried(const JointDescription& joint, int body) const {
    const int carrier = scene_.bodies[at(body)].carrier;
    return carrier >= 0 && std::find(joint.bodies.begin(), joint.bodies.end(), carrier) != joint.bodies.end();
  }

  /// Cluster that a cluster on a hinge turns against.
  int root_of(const Cluster& turning) const { return hinge_parent_[at(turning.hinge)]; }

  bool is_clamped(int cluster) const {
    const auto in_cluster = [&](const RodPass& pass) {
      const auto found = cluster_of_.find({pass.rod, pass.node});
      return pass.on_body() ? clusters_[at(cluster)].body == pass.body()
                            : found != cluster_of_.end() && found->second == cluster;
    };
    return std::any_of(scene_.supports.begin(), scene_.supports.end(), [&](const SupportDescription& support) {
      return holds_frame(support.kind) && in_cluster(support.pass);
    });
  }

  /// A frame for each body, and what it carries: parts follow those that carry them.
  void add_bodies() {
    for (const BodyDescription& body : scene_.bodies) {
      model_.body_frame.push_back(model_.frame_count++);
      frame_node_.push_back(body.node);
    }
    std::vector<bool> follows(at(model_.node_count), false), is_placed(scene_.bodies.size(), false);
    for (const BodyDescription& body : scene_.bodies)
      for (int node : body.carried) follows[at(node)] = true;
    for (std::size_t k = 0; k < slide_places_.size(); ++k) {
      const auto& [root, moving] = slide_places_[k];
      model_.slides[k].frame = model_.body_frame[at(clusters_[at(root)].body)];
      follows[at(slid_node(k))] = true;
    }
    for (std::size_t pass = 0; pass <= scene_.bodies.size(); ++pass)
      for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
        const BodyDescription& body = scene_.bodies[b];
        const bool waits = body.carrier >= 0 && !is_placed[at(body.carrier)];
        if (is_placed[b] || waits || follows[at(body.node)]) continue;
        is_placed[b] = true;
        carry_parts(static_cast<int>(b));
        for (int node : body.carried) follows[at(node)] = false;
        for (std::size_t k = 0; k < slide_places_.size(); ++k)
          if (model_.slides[k].frame == model_.body_frame[b]) follows[at(slid_node(k))] = false;
      }
    require(std::all_of(is_placed.begin(), is_placed.end(), [](bool is) { return is; }),
            "bodies carry each other in a closed loop");
    for (Cluster& cluster : clusters_)
      if (cluster.body >= 0) cluster.frame = model_.body_frame[at(cluster.body)];
    for (const auto& [root, moving] : slide_places_)  // rods on a slide turn with the body
      if (clusters_[at(moving)].body < 0) clusters_[at(moving)].frame = clusters_[at(root)].frame;
  }

  void add_loops() {
    for (const LoopDescription& loop : scene_.loops) {
      Loop out;
      out.copy_node = loop.copy_node;
      out.body_node = loop.body_node;
      out.copy_frame = model_.body_frame[at(loop.copy)];
      out.body_frame = model_.body_frame[at(loop.body)];
      out.body_center = scene_.bodies[at(loop.body)].center;
      out.body = loop.body;
      model_.loops.push_back(out);
    }
  }

  /// Node that moves on a slide: the base of a body, or the node of rods.
  int slid_node(std::size_t slide) const {
    const Cluster& moving = clusters_[at(slide_places_[slide].second)];
    return moving.body >= 0 ? scene_.bodies[at(moving.body)].node : node_of(moving);
  }

  void carry_parts(int index) {
    const BodyDescription& body = scene_.bodies[at(index)];
    const int frame = model_.body_frame[at(index)];
    for (std::size_t h = 0; h < model_.hinges.size(); ++h)
      if (hinged_body_[h] >= 0 && model_.body_frame[at(hinged_body_[h])] == frame) {
        CarriedPart part;
        part.frame = model_.body_frame[at(body.carrier)];
        part.own_frame = frame;
        part.hinge = static_cast<int>(h);
        model_.carried.push_back(part);
      }
    for (std::size_t k = 0; k < slide_places_.size(); ++k) {
      const auto& [root, moving] = slide_places_[k];
      if (clusters_[at(moving)].body >= 0 && model_.body_frame[at(clusters_[at(moving)].body)] == frame) {
        CarriedPart part;
        part.frame = model_.slides[k].frame;
        part.own_frame = frame;
        model_.carried.push_back(part);
      }
    }
    double mass = scene_.added_mass(body.node);
    for (std::size_t k = 0; k < slide_places_.size(); ++k) {
      if (model_.slides[k].frame != frame) continue;
      CarriedPart part;
      part.frame = frame;
      part.node = slid_node(k);
      part.base = body.node;
      part.slide = static_cast<int>(k);
      part.arm = scene_.positions.row(part.node) - scene_.positions.row(body.node);
      model_.carried.push_back(part);
    }
    for (int node : body.carried) {
      CarriedPart part;
      part.frame = frame;
      part.node = node;
      part.base = body.node;
      part.arm = scene_.positions.row(node) - scene_.positions.row(body.node);
      model_.carried.push_back(part);
      model_.length_scale = std::max(model_.length_scale, part.arm.norm());
      mass += scene_.added_mass(node);
    }
    for (int r = 0; r < static_cast<int>(scene_.rods.size()); ++r) {
      if (rod(r).body != index) continue;
      for (int e = first_edge(r); e < first_edge(r) + edges_of(r); ++e) {
        CarriedPart part;
        part.frame = frame;
        part.base = body.node;
        part.edge = e;
        model_.carried.push_back(part);
      }
    }
    if (mass > 0.0) model_.length_scale = std::max(model_.length_scale, std::sqrt(body.inertia.trace() / mass));
  }

  /// Makes two clusters one.
  void merge(int to, int from) {
    if (to == from) return;
    if (clusters_[at(from)].body >= 0) clusters_[at(to)].body = clusters_[at(from)].body;
    for (const RodPass& pass : clusters_[at(from)].passes) {
      clusters_[at(to)].passes.push_back(pass);
      cluster_of_[{pass.rod, pass.node}] = to;
    }
    clusters_[at(from)].passes.clear();
    clusters_[at(from)].merged_into = to;
  }

  void find_joint_angles() {
    for (const auto& [parent, child, sign, hinge, turns, slide, stops] : links_) {
      JointAngle joint;
      joint.sign = sign;
      joint.stops = stops;
      joint.stops.impact_loss = impact_loss(stops.restitution);
      joint.node = node_of(clusters_[at(clusters_[at(parent)].passes.empty() ? child : parent)]);
      if (slide >= 0) {
        joint.turning = model_.slides[at(slide)].dof;
      } else if (hinge >= 0) {
        joint.turning = model_.hinges[at(hinge)].dof;
      } else if (turns) {
        joint.turning = model_.frame_dof[at(clusters_[at(child)].frame)];
        joint.against = model_.frame_dof[at(clusters_[at(parent)].frame)];
      }
      model_.joint_angles.push_back(joint);
    }
  }

  Cluster& cluster_at(RodPass pass) {
    const auto found = cluster_of_.find({pass.rod, pass.node});
    if (found != cluster_of_.end()) return clusters_[static_cast<std::size_t>(found->second)];
    cluster_of_[{pass.rod, pass.node}] = static_cast<int>(clusters_.size());
    clusters_.push_back({{pass}, -1, JointForm::frame});
    return clusters_.back();
  }

  int frame_of(Cluster& cluster) {
    if (cluster.frame < 0) {
      cluster.frame = model_.frame_count++;
      frame_node_.push_back(node_of(cluster));
    }
    return cluster.frame;
  }

  /// Two ends that continue each other smoothly, with aligned directors, are one rod.
  bool continues(const Cluster& c) const {
    if (c.body >= 0 || c.passes.size() != 2 || c.form != JointForm::frame) return false;
    const auto [a, b] = ordered(c);
    const int in = edges_at(a).in, out = edges_at(b).out;
    if (in < 0 || out < 0 || edges_at(a).out >= 0 || edges_at(b).in >= 0) return false;
    // A stencil across a drawn corner would be stiffer by 1 / cos^4 of half its angle, so corners get a frame.
    constexpr double kSmooth = 1e-2;
    return rotation_log(drawn_frame_at(b) * drawn_frame_at(a).transpose()).norm() < kSmooth;
  }
  std::pair<RodPass, RodPass> ordered(const Cluster& c) const {
    const RodPass a = c.passes[0], b = c.passes[1];
    return edges_at(a).in >= 0 ? std::pair{a, b} : std::pair{b, a};
  }

  void add_frames() {
    for (const SupportDescription& support : scene_.supports)
      if (holds_frame(support.kind) && !support.pass.on_body()) {
        Cluster& cluster = cluster_at(support.pass);
        if (cluster.hinge >= 0)
          throw std::invalid_argument("a clamp at a hinge must hold the rod that the hinge turns against, not rod '" +
                                      rod(support.pass.rod).name + "', which turns: clamp rod '" +
                                      rod(clusters_[at(root_of(cluster))].passes.front().rod).name +
                                      "' there, or use hold=\"edge\"");
        frame_of(cluster);
        if (support.gripped && cluster.passes.size() == 1) gripped_frames_.insert(cluster.frame);
      }
    for (std::size_t h = 0; h < model_.hinges.size(); ++h)
      model_.hinges[h].frame = frame_of(clusters_[static_cast<std::size_t>(hinge_parent_[h])]);
    if (model_.planar())
      for (const LinkPlace& link : links_)
        for (int side : {link.parent, link.child})
          if (link.turns) frame_of(clusters_[at(side)]);
    for (Cluster& cluster : clusters_)
      if (cluster.hinge < 0 && cluster.passes.size() > 1 && cluster.form == JointForm::frame && !continues(cluster))
        frame_of(cluster);
    for (Cluster& cluster : clusters_)
      if (cluster.hinge >= 0) cluster.frame = model_.hinges[static_cast<std::size_t>(cluster.hinge)].frame;
  }

  Matrix3 drawn_frame_at(RodPass pass) const {
    const FrameEdges edges = frame_edges(rod(pass.rod), first_edge(pass.rod), pass.node);
    return drawn_frame(edges, drawn_edge_frame(model_, edges.before), drawn_edge_frame(model_, edges.after),
                       model_.edge_length(edges.before), model_.edge_length(edges.after));
  }

  void add_half(const Cluster& cluster, RodPass pass, int edge, bool frame_first) {
    const int stencils = static_cast<int>(rod(pass.rod).natural_twist.size());
    const int shift = rod(pass.rod).closed ? 0 : 1;
    const int nearest = stencils == 0 ? -1 : std::clamp(pass.node - shift, 0, stencils - 1);
    const int index = static_cast<int>(model_.half.size());
    model_.half.push_back({cluster.frame, edge, cluster.hinge, frame_first, drawn_frame_at(pass)});
    half_voronoi_.push_back(0.5 * model_.edge_arc(edge));
    model_.half_owner.emplace_back(pass.rod, nearest);
    const int own = pass.node - shift;
    if (own >= 0 && own < stencils) {
      StencilPlace& place = model_.place[static_cast<std::size_t>(pass.rod)][static_cast<std::size_t>(own)];
      place.half[frame_first ? 1 : 0] = index;
    }
    if (pass.node == 0 && frame_first && !rod(pass.rod).closed)
      model_.wall_half[static_cast<std::size_t>(pass.rod)][0] = index;
    if (pass.node == edges_of(pass.rod) && !rod(pass.rod).closed)
      model_.wall_half[static_cast<std::size_t>(pass.rod)][1] = index;
  }

  int add_bend(int e0, int e1, int s0, int s1, std::pair<int, int> owner, bool keep_drawn) {
    const auto end = [&](int e, bool far, int sign) {
      const auto i = static_cast<std::size_t>(e);
      return far == (sign > 0) ? model_.edge_tail[i] : model_.edge_head[i];
    };
    model_.bend.push_back({{e0, e1}, {end(e0, true, s0), end(e0, false, s0), end(e1, false, s1)}, {s0, s1}});
    if (owner.first < 0) model_.bend_across.push_back(static_cast<int>(model_.bend.size()) - 1);
    model_.bend_owner.push_back(owner);
    bend_voronoi_.push_back(0.5 * (model_.edge_arc(e0) + model_.edge_arc(e1)));
    offsets_keep_drawn_.push_back(keep_drawn);
    return static_cast<int>(model_.bend.size()) - 1;
  }

  void add_stencils() {
    for (std::size_t r = 0; r < scene_.rods.size(); ++r) {
      const int index = static_cast<int>(r), n = edges_of(index), shift = rod(index).closed ? 0 : 1;
      model_.place.emplace_back(static_cast<std::size_t>(rod(index).natural_twist.size()));
      model_.wall_half.push_back({-1, -1});
      if (rod(index).is_surface()) continue;
      for (int node = 0; node < n + shift; ++node) {
        const RodPass pass{index, node};
        const auto [in, out] = edges_at(pass);
        const auto found = cluster_of_.find({index, node});
        const Cluster* c = found == cluster_of_.end() ? nullptr : &clusters_[static_cast<std::size_t>(found->second)];
        if (c && c->frame >= 0) {
          if (in >= 0) add_half(*c, pass, in, false);
          if (out >= 0) add_half(*c, pass, out, true);
        } else if (in >= 0 && out >= 0) {
          model_.place[r][static_cast<std::size_t>(node - shift)].bend =
              add_bend(in, out, 1, 1, {index, node - shift}, false);
        }
      }
    }
    for (const Cluster& cluster : clusters_) {
      if (cluster.frame >= 0 || cluster.passes.size() < 2) continue;
      if (cluster.form == JointForm::pairs) {
        add_pairs(cluster);
      } else {
        const auto [a, b] = ordered(cluster);
        add_bend(edges_at(a).in, edges_at(b).out, 1, 1, {-1, -1}, true);
      }
    }
    model_.bend_voronoi = to_vector(bend_voronoi_);
    model_.half_voronoi = to_vector(half_voronoi_);
  }

  /// [Choi, dissertation 6.2.2]: every pair of edges at the node that is not a rod's own stencil.
  void add_pairs(const Cluster& cluster) {
    struct End {
      int rod, edge;
      bool arrives;
    };
    std::vector<End> ends;
    for (const RodPass& pass : cluster.passes) {
      const auto [in, out] = edges_at(pass);
      if (in >= 0) ends.push_back({pass.rod, in, true});
      if (out >= 0) ends.push_back({pass.rod, out, false});
    }
    for (std::size_t i = 0; i < ends.size(); ++i)
      for (std::size_t j = i + 1; j < ends.size(); ++j) {
        if (ends[i].rod == ends[j].rod) continue;
        add_bend(ends[i].edge, ends[j].edge, ends[i].arrives ? 1 : -1, ends[j].arrives ? -1 : 1, {-1, -2}, true);
      }
  }

  void resolve_supports() {
    for (const SupportDescription& description : scene_.supports) {
      Support s;
      s.active = true;
      s.description = description;
      s.node = global_node(description.pass);
      if (description.pass.on_body()) {
        if (holds_frame(description.kind)) s.frame = model_.body_frame[at(description.pass.body())];
        model_.supports.push_back(s);
        continue;
      }
      const auto [in, out] = edges_at(description.pass);
      const auto e = static_cast<std::size_t>(out >= 0 ? out : in);
      s.tangent = to_eigen(model_.initial_tangent[e]);
      if (holds_frame(description.kind)) {
        s.frame = cluster_at(description.pass).frame;
        s.tangent = drawn_frame_at(description.pass).col(2);
      } else if (holds_edge(description.kind)) {
        s.edge = static_cast<int>(e);
        s.other_node = model_.edge_tail[e] == s.node ? model_.edge_head[e] : model_.edge_tail[e];
      } else if (s.is_hand()) {
        find_touched(model_, s);
      }
      model_.supports.push_back(s);
    }
    model_.frame_dof.assign(static_cast<std::size_t>(model_.frame_count), -1);
    model_.frame_node = frame_node_;
  }

  /// Edges whose direction a clamp, a hand, one that yields too, or a support at either end holds.
  std::vector<bool> held_edges() const {
    std::vector<bool> held(static_cast<std::size_t>(model_.edge_count), false);
    std::vector<bool> fixed(static_cast<std::size_t>(model_.node_count), false);
    for (const Support& support : model_.supports)
      if (!support.is_hand() && support.description.free.isZero()) fixed[static_cast<std::size_t>(support.node)] = true;
    for (std::size_t e = 0; e < held.size(); ++e)
      held[e] =
          fixed[static_cast<std::size_t>(model_.edge_tail[e])] && fixed[static_cast<std::size_t>(model_.edge_head[e])];
    for (const Support& support : model_.supports) {
      if (support.edge >= 0) held[static_cast<std::size_t>(support.edge)] = true;
      if (!support.is_hand() || support.slides()) continue;
      for (const TouchedEdge& touched : support.touched) held[static_cast<std::size_t>(touched.edge)] = true;
    }
    return held;
  }

  /// Strains at nodes are a trapezoidal rule along the rod. At a frame the moment ends with a slope. The first of
  /// Gregory's end corrections (weights 5/12, 13/12, 1, 1, ... edges) makes the rule third order there: the node next
  /// to a frame carries a twelfth of an edge for the frame. There are two exceptions. A rod that is gripped during a
  /// run must not change. An edge that is held or once was (`UncorrectedEnd`) passes no bending from one side to the
  /// other:
  /// a correction across it would be an error of first order.
  void share_bending() {
    const std::vector<bool> held = held_edges();
    std::vector<UncorrectedEnd>& ends = model_.description.uncorrected_ends;
    const std::vector<UncorrectedEnd> before = std::exchange(ends, {});
    model_.bend_share = MatrixX2::Constant(static_cast<Eigen::Index>(model_.bend.size()), 2, 0.5);
    model_.half_share = VectorX::Constant(static_cast<Eigen::Index>(model_.half.size()), 0.5);
    std::vector<std::vector<std::pair<Eigen::Index, int>>> bends(static_cast<std::size_t>(model_.edge_count));
    for (std::size_t b = 0; b < model_.bend.size(); ++b)
      for (int k : {0, 1})
        bends[static_cast<std::size_t>(model_.bend[b].edge[k])].emplace_back(static_cast<Eigen::Index>(b), k);
    for (Eigen::Index h = 0; h < model_.half_share.size(); ++h) {
      const FrameStencil& half = model_.half[static_cast<std::size_t>(h)];
      const auto& next = bends[static_cast<std::size_t>(half.edge)];
      if (gripped_frames_.contains(half.frame)) continue;
      if (next.size() != 1) continue;  // nobody to carry it, or an end in a joint of pairs
      const auto& [bend, side] = next.front();
      const auto known = std::find_if(before.begin(), before.end(), [&](const UncorrectedEnd& end) {
        return end.is_of(half.edge, half.frame_first);
      });
      if (known != before.end() || held[static_cast<std::size_t>(half.edge)]) {
        ends.push_back(known != before.end() ? *known : UncorrectedEnd{half.edge, half.frame_first});
        model_.uncorrected_ends.emplace_back(static_cast<int>(h), static_cast<int>(bend));
        continue;
      }
      constexpr double kCarried = 1.0 / 12.0;
      model_.half_share(h) -= kCarried;
      model_.bend_share(bend, side) += kCarried;
    }
  }

  void find_components() {
    std::vector<int> parent(static_cast<std::size_t>(model_.node_count));
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int node) {
      while (parent[static_cast<std::size_t>(node)] != node) node = parent[static_cast<std::size_t>(node)];
      return node;
    };
    const auto connect = [&](int a, int b) { parent[static_cast<std::size_t>(root(a))] = root(b); };
    for (std::size_t e = 0; e < model_.edge_tail.size(); ++e) connect(model_.edge_tail[e], model_.edge_head[e]);
    for (const SpringDescription& spring : scene_.springs) connect(spring.nodes[0], spring.nodes[1]);
    for (const TorsionDescription& torsion : scene_.torsions)
      connect(scene_.rods[static_cast<std::size_t>(torsion.rods[0])].nodes[0],
              scene_.rods[static_cast<std::size_t>(torsion.rods[1])].nodes[0]);
    const auto node_of_guide = [&](const TendonGuide& guide) {
      return guide.on_body() ? guide.edge : scene_.rods[static_cast<std::size_t>(guide.rod)].nodes[0];
    };
    for (const TendonDescription& tendon : scene_.tendons)
      for (const TendonGuide& guide : tendon.guides)
        connect(node_of_guide(tendon.guides.front()), node_of_guide(guide));
    for (const SupportDescription& support : scene_.supports)
      if (support.hand.node >= 0) connect(support.hand.node, global_node(support.pass));
    for (const Cluster& cluster : clusters_)
      for (const RodPass& pass : cluster.passes) connect(global_node(cluster.passes.front()), global_node(pass));
    for (const CarriedPart& carried : model_.carried)
      if (carried.is_node()) connect(carried.base, carried.node);
    for (const Loop& loop : model_.loops) connect(loop.copy_node, loop.body_node);
    std::vector<int> number(parent.size(), -1);
    const auto component_of = [&](int node) {
      int& found = number[static_cast<std::size_t>(root(node))];
      if (found < 0) found = model_.component_count++;
      return found;
    };
    std::vector<int>& out = model_.dof_component;
    out.assign(static_cast<std::size_t>(model_.dof_count), 0);
    const auto set = [&](int dof, int size, int node) { std::fill_n(out.begin() + dof, size, component_of(node)); };
    for (int i = 0; i < model_.node_count; ++i) set(model_.node_dof[static_cast<std::size_t>(i)], model_.dimension, i);
    for (std::size_t e = 0; e < model_.edge_dof.size(); ++e) set(model_.edge_dof[e], 1, model_.edge_tail[e]);
    for (std::size_t f = 0; f < model_.frame_dof.size(); ++f)
      set(model_.frame_dof[f], model_.frame_size(), model_.frame_node[f]);
    for (const Loop& loop : model_.loops) set(loop.dof, model_.loop_size(), loop.body_node);
    for (const Slide& slide : model_.slides)
      set(slide.dof, 1, model_.frame_node[static_cast<std::size_t>(slide.frame)]);
    for (const Hinge& hinge : model_.hinges)
      if (hinge.dof >= 0) set(hinge.dof, 1, model_.frame_node[static_cast<std::size_t>(hinge.frame)]);
  }

  /// Unknowns, strains and offsets of the drawn state.
  void draw() {
    model_.initial_q = VectorX::Zero(model_.dof_count);
    for (int i = 0; i < model_.node_count; ++i) put_node(model_, i, scene_.positions.row(i), model_.initial_q);
    const auto n = static_cast<Eigen::Index>(model_.bend.size());
    model_.bend_offset = MatrixX3::Zero(n, 3);
    model_.half_offset = MatrixX3::Zero(static_cast<Eigen::Index>(model_.half.size()), 3);
    model_.initial_bend_tau = VectorX::Zero(n);
    for (Eigen::Index b = 0; b < n; ++b) {
      const BendStencil& s = model_.bend[static_cast<std::size_t>(b)];
      const auto strain =
          bend_twist_strain(strain_frame(s.edge[0], s.sign[0]), strain_frame(s.edge[1], s.sign[1]), 0.0);
      model_.initial_bend_tau(b) = strain.tau;
      if (!offsets_keep_drawn_[static_cast<std::size_t>(b)]) continue;
      if (model_.planar()) {
        const Vec3d t0 = strain_frame(s.edge[0], s.sign[0]).tangent, t1 = strain_frame(s.edge[1], s.sign[1]).tangent;
        const double turn = to_eigen(cross(t0, t1)).dot(model_.plane->normal);
        model_.bend_offset(b, 0) = 2.0 * turn / (1.0 + dot(t0, t1));
      } else {
        model_.bend_offset.row(b) << strain.kappa1, strain.kappa2, strain.tau;
      }
    }
    // Natural strains of the rods are added later, so those of the drawing are subtracted here.
    const MatrixX3 drawn = model_.bend_offset;
    model_.bend_offset.setZero();
    const Parameters natural = initial_parameters(model_);
    for (Eigen::Index b = 0; b < n; ++b) {
      if (!offsets_keep_drawn_[static_cast<std::size_t>(b)]) continue;
      model_.bend_offset.row(b) = measured(natural.measure, drawn.row(b)) - natural.bend_natural.row(b);
    }
    model_.initial_half_tau = VectorX::Zero(static_cast<Eigen::Index>(model_.half.size()));
    for (std::size_t i = 0; i < model_.uncorrected_ends.size(); ++i) {
      const UncorrectedEnd& end = scene_.uncorrected_ends[i];
      add_offsets(model_, i, end.at_frame, end.at_next);
    }
  }

  Model& model_;
  const SceneDescription& scene_;
  std::vector<Cluster> clusters_;
  std::map<Key, int> cluster_of_;
  std::set<int> gripped_frames_;
  std::vector<LinkPlace> links_;
  std::vector<std::pair<int, int>> slide_places_;  // clusters: on whose body, and that which moves
  std::vector<int> hinge_parent_, hinged_body_, frame_node_;
  std::vector<double> bend_voronoi_, half_voronoi_;
  std::vector<bool> offsets_keep_drawn_;
};

}  // namespace

void add_offsets(Model& model, std::size_t uncorrected_end, const Vector3& at_frame, const Vector3& at_next) {
  const auto& [half, bend] = model.uncorrected_ends[uncorrected_end];
  const int rod = model.edge_rod[static_cast<std::size_t>(model.half[static_cast<std::size_t>(half)].edge)];
  const auto in_model = [&](const Vector3& strain) -> Vector3 {
    if (!model.planar()) return strain;
    return {model.planar_components[static_cast<std::size_t>(rod)].dot(strain.head<2>()), 0.0, 0.0};
  };
  model.half_offset.row(half) += in_model(at_frame).transpose();
  model.bend_offset.row(bend) += in_model(at_next).transpose();
}

namespace {

void check_tendon(const SceneDescription& scene, const TendonDescription& tendon) {
  require(tendon.guides.size() >= 2, "a tendon must have two guides or more");
  require(tendon.offsets.rows() == static_cast<Eigen::Index>(tendon.guides.size()) && tendon.offsets.allFinite(),
          "a tendon must have a finite offset for each of its guides");
  require(tendon.tension >= 0.0 && std::isfinite(tendon.tension),
          "tension of a tendon must be finite and not negative, got " + std::to_string(tendon.tension));
  const TendonGuide* before = nullptr;
  for (const TendonGuide& guide : tendon.guides) {
    if (guide.on_body())
      require(is_there(scene, {guide.rod, guide.edge}), "guide of a tendon must be a point of a body of the scene");
    else
      require(guide.rod < static_cast<int>(scene.rods.size()) && guide.edge >= 0 &&
                  guide.edge < scene.rods[static_cast<std::size_t>(guide.rod)].rest_lengths.size(),
              "guide of a tendon must lie on an edge of the scene");
    require(!before || *before != guide, "a tendon must run from each guide to another");
    before = &guide;
  }
}

void check_torsion(const SceneDescription& scene, const TorsionDescription& torsion) {
  for (std::size_t k = 0; k < 2; ++k) {
    const int rod = torsion.rods[k], edge = torsion.edges[k];
    require(rod >= 0 && rod < static_cast<int>(scene.rods.size()) && edge >= 0 &&
                edge < scene.rods[static_cast<std::size_t>(rod)].rest_lengths.size(),
            "torsion spring on an edge that is not there");
  }
  require(torsion.rods[0] != torsion.rods[1] || torsion.edges[0] != torsion.edges[1],
          "a torsion spring must act between two different edges");
  constexpr double kRounding = 1e-12;
  const Vector3 &n = torsion.axis, &u = torsion.reference;
  require(
      std::abs(n.norm() - 1.0) < kRounding && std::abs(u.norm() - 1.0) < kRounding && std::abs(n.dot(u)) < kRounding,
      "axis and reference of a torsion spring must be normal to each other, and of unit length");
}

}  // namespace

Model build_model(const SceneDescription& description, std::optional<bool> planar) {
  require(!description.rods.empty() || !description.bodies.empty(), "the scene has no rods: add one with add_rod");
  for (const SpringDescription& spring : description.springs) {
    for (int node : spring.nodes)
      require(node >= 0 && node < description.positions.rows(), "spring at a node that is not there");
    require(spring.nodes[0] != spring.nodes[1], "a spring must act between two different nodes");
  }
  for (const TendonDescription& tendon : description.tendons) check_tendon(description, tendon);
  for (const TorsionDescription& torsion : description.torsions) check_torsion(description, torsion);
  for (const LoadDescription& load : description.loads) check_load(description, load);
  Model model;
  model.description = description;
  if (planar.value_or(true)) model.plane = find_plane(description, planar, model.plane_reason);
  require(!planar.value_or(false) || model.plane, "planar=True, but " + model.plane_reason);
  model.dimension = model.plane ? 2 : 3;
  Builder(model).build();
  return model;
}

}  // namespace withe
