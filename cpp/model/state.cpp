#include "model/state.hpp"

#include "geometry/curvature.hpp"
#include "geometry/frame_kernels.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

static_assert(sizeof(Vec3d) == 3 * sizeof(double));
static_assert(sizeof(EdgeFrame<double>) == kFrameNumbers * sizeof(double));

EdgeBatch edge_batch(const Model& model, const VectorX& q, Configuration& out) {
  return {.count = model.edge_count,
          .tail = model.tail_dof.data(),
          .head = model.head_dof.data(),
          .angle = model.edge_dof.data(),
          .q = q.data(),
          .source = nullptr,
          .reference = nullptr,
          .frames = &out.edge.data()->tangent.x,
          .length = out.length.data()};
}

StrainBatch strain_batch(const Model& model, Configuration& out) {
  static_assert(sizeof(BendStencil) % sizeof(int) == 0);
  return {.count = static_cast<int>(model.bend.size()),
          .edges = model.bend.empty() ? nullptr : model.bend.data()->edge,
          .edge_stride = sizeof(BendStencil) / sizeof(int),
          .frames = &out.edge.data()->tangent.x,
          .previous_tau = nullptr,
          .strain = out.bend_strain.data(),
          .column = out.bend_strain.rows()};
}

/// Attached ends of joints, in a plane.
void attach_planar(const Model& model, const VectorX& q, Configuration& out) {
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& s = model.half[h];
    const double angle = q(model.frame_dof[static_cast<std::size_t>(s.frame)]);
    const Vector3 drawn = s.attachment.col(2);
    const double x = drawn.dot(model.plane->first), y = drawn.dot(model.plane->second);
    const double c = std::cos(angle), sn = std::sin(angle);
    out.attached[h].tangent = {c * x - sn * y, sn * x + c * y, 0.0};
    out.attached[h].inverse_length = 1.0;
  }
}

void compute_planar_strains(const Model& model, Configuration& out) {
  frame_kernels().planar_strains(strain_batch(model, out));
  for (int b : model.reversed_bend) {
    const BendStencil& s = model.bend[static_cast<std::size_t>(b)];
    const Vec3d t0 = s.sign[0] * out.edge[static_cast<std::size_t>(s.edge[0])].tangent;
    const Vec3d t1 = s.sign[1] * out.edge[static_cast<std::size_t>(s.edge[1])].tangent;
    out.bend_strain(b, 0) = planar_kappa(t0.x, t0.y, t1.x, t1.y);
  }
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& s = model.half[h];
    const Vec3d &a = out.attached[h].tangent, &t = out.edge[static_cast<std::size_t>(s.edge)].tangent;
    out.half_strain(static_cast<Eigen::Index>(h), 0) =
        s.frame_first ? planar_kappa(a.x, a.y, t.x, t.y) : planar_kappa(t.x, t.y, a.x, a.y);
  }
}

EdgeBatch spatial_batch(const Model& model, const State& state, const VectorX& q, Configuration& out) {
  EdgeBatch edges = edge_batch(model, q, out);
  edges.source = &state.tangent.data()->x;
  edges.reference = &state.director.data()->x;
  return edges;
}

/// Frames of joints and their attached parts, in space.
void attach(const Model& model, const State& state, const VectorX& q, Configuration& out) {
  for (int f = 0; f < model.frame_count; ++f) {
    const auto i = static_cast<std::size_t>(f);
    out.frame[i] = cayley(q.segment<3>(model.frame_dof[i])) * state.frame[i];
  }
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& s = model.half[h];
    Matrix3 m = s.attachment;
    if (s.hinge >= 0) m = hinge_turn(model, q, s.hinge) * m;
    m = out.frame[static_cast<std::size_t>(s.frame)] * m;
    out.attached[h] = {to_vec3(m.col(2)), to_vec3(m.col(0)), to_vec3(m.col(1)), 1.0, {}, {}};
  }
}

/// All that follows from the frames, in space.
void compute_strains(const Model& model, const State& state, Configuration& out) {
  StrainBatch strains = strain_batch(model, out);
  strains.previous_tau = state.bend_tau.data();
  frame_kernels().strains(strains);
  for (int b : model.reversed_bend) {
    const BendStencil& s = model.bend[static_cast<std::size_t>(b)];
    const auto strain =
        bend_twist_strain(oriented(out.edge[static_cast<std::size_t>(s.edge[0])], s.sign[0]),
                          oriented(out.edge[static_cast<std::size_t>(s.edge[1])], s.sign[1]), state.bend_tau(b));
    out.bend_strain.row(b) << strain.kappa1, strain.kappa2, strain.tau;
  }
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& s = model.half[h];
    const EdgeFrame<double>& edge = out.edge[static_cast<std::size_t>(s.edge)];
    const auto i = static_cast<Eigen::Index>(h);
    const auto strain = s.frame_first ? bend_twist_strain(out.attached[h], edge, state.half_tau(i))
                                      : bend_twist_strain(edge, out.attached[h], state.half_tau(i));
    out.half_strain.row(i) << strain.kappa1, strain.kappa2, strain.tau;
  }
}

}  // namespace

ObstaclePlace obstacle_place(const Model& model, const ObstacleDescription& drawn, const ObstacleWay& way) {
  const auto place = [&](const Vector3& x) {
    return in_axes(model, model.planar() ? Vector3(x - model.plane->origin) : x);
  };
  const bool plane = drawn.kind == ObstacleKind::plane;
  const Vec3d turn = model.planar() ? Vec3d{0.0, 0.0, way.turn.dot(model.plane->normal)} : to_vec3(way.turn);
  return {place(drawn.point + way.shift), plane ? in_axes(model, drawn.other) : place(drawn.other + way.shift), turn};
}

ObstacleWay way_from_drawn(const Model& model, const ObstacleDescription& drawn, const ObstaclePlace& place) {
  const Vec3d way = place.point - obstacle_place(model, drawn).point;
  if (!model.planar()) return {to_eigen(way), to_eigen(place.turn)};
  return {way.x * model.plane->first + way.y * model.plane->second, place.turn.z * model.plane->normal};
}

State initial_state(const Model& model) {
  State state;
  state.q = model.initial_q;
  state.v = VectorX::Zero(model.dof_count);
  state.acceleration = VectorX::Zero(model.dof_count);
  state.tangent = model.initial_tangent;
  state.director = model.initial_director;
  state.frame.assign(static_cast<std::size_t>(model.frame_count), Matrix3::Identity());
  state.bend_tau = model.initial_bend_tau;
  state.half_tau = model.initial_half_tau;
  for (const ObstacleDescription& o : model.description.contact.obstacles)
    state.obstacles.push_back(obstacle_place(model, o));
  state.hands.resize(model.supports.size());
  if (model.description.fluid.model == FluidModel::stokeslets || model.description.has_custom_force ||
      !model.constraints.empty())
    for (VectorX& v : state.motion.velocity) v = VectorX::Zero(model.dof_count);
  return state;
}

namespace {

void allocate(const Model& model, Configuration& out) {
  if (out.edge.size() != static_cast<std::size_t>(model.edge_count) ||
      out.frame.size() != static_cast<std::size_t>(model.frame_count)) {
    out.edge.assign(static_cast<std::size_t>(model.edge_count), EdgeFrame<double>{});
    out.length.resize(model.edge_count);
    out.frame.assign(static_cast<std::size_t>(model.frame_count), Matrix3::Identity());
    out.attached.assign(model.half.size(), EdgeFrame<double>{});
    out.bend_strain = Columns3::Zero(static_cast<Eigen::Index>(model.bend.size()), 3);
    out.half_strain = Columns3::Zero(static_cast<Eigen::Index>(model.half.size()), 3);
  }
}

/// Parts that bodies carry are in their places up to rounding, which must not add up over steps. `frames`: of bodies.
void place_carried(const Model& model, const std::vector<Matrix3>& frames, VectorX& q) {
  for (const CarriedPart& part : model.carried) {
    if (!part.is_node()) continue;
    const int own = part.own_dof, base = part.body_dofs.front();
    Vector3 arm = part.arm;
    if (part.slide >= 0) {
      const Slide& slide = model.slides[at(part.slide)];
      arm += q(slide.dof) * slide.axis;
    }
    if (model.planar()) {
      const double angle = q(model.frame_dof[at(part.frame)]), c = std::cos(angle), s = std::sin(angle);
      const double x = arm.dot(model.plane->first), y = arm.dot(model.plane->second);
      q.segment<2>(own) = q.segment<2>(base) + Vector2(c * x - s * y, s * x + c * y);
    } else {
      q.segment<3>(own) = q.segment<3>(base) + frames[at(part.frame)] * arm;
    }
  }
}

/// Joints' frames and the branches of twists, of a configuration in space.
void accept_frames(const Model& model, const Configuration& configuration, State& state) {
  for (int f = 0; f < model.frame_count; ++f) {
    const auto i = static_cast<std::size_t>(f);
    state.frame[i] = orthonormalized(configuration.frame[i]);
    state.q.segment<3>(model.frame_dof[i]).setZero();
  }
  for (const CarriedPart& part : model.carried)
    if (part.is_frame())
      state.frame[at(part.own_frame)] = state.frame[at(part.frame)] * hinge_turn(model, state.q, part.hinge);
  state.bend_tau = configuration.bend_strain.col(2);
  state.half_tau = configuration.half_strain.col(2);
}

}  // namespace

void compute_frames(const Model& model, const State& state, const VectorX& q, Configuration& out) {
  allocate(model, out);
  if (model.planar()) {
    frame_kernels().planar_edges(edge_batch(model, q, out));
    attach_planar(model, q, out);
  } else {
    frame_kernels().edges(spatial_batch(model, state, q, out));
    attach(model, state, q, out);
  }
}

void compute_configuration(const Model& model, const State& state, const VectorX& q, Configuration& out) {
  compute_frames(model, state, q, out);
  model.planar() ? compute_planar_strains(model, out) : compute_strains(model, state, out);
}

double advance_configuration(const Model& model, const State& state, const VectorX& q, Configuration& out,
                             State& next) {
  allocate(model, out);
  const double cosine = frame_kernels().advance({.edges = spatial_batch(model, state, q, out),
                                                 .next_source = &next.tangent.data()->x,
                                                 .next_reference = &next.director.data()->x});
  attach(model, state, q, out);
  compute_strains(model, state, out);
  next.q = q;
  accept_frames(model, out, next);
  return cosine;
}

void accept_configuration(const Model& model, const VectorX& q, const Configuration& configuration, State& state) {
  state.q = q;
  if (model.planar()) {
    for (const CarriedPart& part : model.carried)
      if (part.is_frame() && part.hinge < 0) state.q(part.own_dof) = state.q(part.body_dofs.front());
    place_carried(model, state.frame, state.q);
    return;
  }
  frame_kernels().carry({.count = model.edge_count,
                         .frames = &configuration.edge.data()->tangent.x,
                         .source = &state.tangent.data()->x,
                         .reference = &state.director.data()->x});
  accept_frames(model, configuration, state);
  place_carried(model, state.frame, state.q);
}

Matrix3 hinge_turn(const Model& model, const VectorX& q, int hinge) {
  if (hinge < 0) return Matrix3::Identity();
  const auto& [frame, axis, dof] = model.hinges[static_cast<std::size_t>(hinge)];
  return rotation_exp(q(dof) * axis);
}

Matrix3 edge_directors(const Model& model, const Configuration& c, int edge) {
  Matrix3 out;
  const EdgeFrame<double>& f = c.edge[at(edge)];
  if (!model.planar()) {
    out << to_eigen(f.d1), to_eigen(f.d2), to_eigen(f.tangent);
    return out;
  }
  // In its plane an edge turns its drawn directors about the normal.
  const Vector3 drawn = to_eigen(model.initial_tangent[at(edge)]), d1 = to_eigen(model.initial_director[at(edge)]);
  const Vector3 t = f.tangent.x * model.plane->first + f.tangent.y * model.plane->second;
  const Vector3& n = model.plane->normal;
  const double angle = std::atan2(drawn.cross(t).dot(n), drawn.dot(t));
  const Vector3 now = rotation_exp(angle * n) * d1;
  out << now, t.cross(now), t;
  return out;
}

}  // namespace withe
