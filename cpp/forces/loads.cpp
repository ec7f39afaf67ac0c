#include "forces/loads.hpp"

#include <algorithm>

#include "common/check.hpp"
#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// Value of a follower load now: it turns with its edge from the drawn configuration.
Vector3 carried(const Model& model, const EdgeFrame<double>& f, int edge, const Vector3& value) {
  const Vector3 t = to_eigen(model.initial_tangent[at(edge)]);
  if (model.planar()) {
    const Plane& plane = *model.plane;
    const Vector3 n = plane.normal, side = n.cross(t);
    const Vector3 now = plane.first * f.tangent.x + plane.second * f.tangent.y;
    return now * value.dot(t) + n.cross(now) * value.dot(side);
  }
  const Vector3 d1 = to_eigen(model.initial_director[at(edge)]), d2 = t.cross(d1);
  return to_eigen(f.d1) * value.dot(d1) + to_eigen(f.d2) * value.dot(d2) + to_eigen(f.tangent) * value.dot(t);
}

/// Full derivative of the spin vector of an edge frame with respect to the edge vector.
Matrix3 spin_derivative(const EdgeFrame<double>& f, const Vec3d& source) {
  const double k = f.inverse_length * f.inverse_length / (1.0 + dot(source, f.tangent));
  return -k * cross_matrix(to_eigen(source)) - to_eigen(f.spin) * to_eigen(f.bow).transpose();
}

void clear(Local& out, int n) {
  for (int i = 0; i < n; ++i) {
    out.gradient[i] = 0.0;
    for (int j = 0; j < n; ++j) out.hessian[i][j] = 0.0;
  }
}

void moment_on_edge(const Model& model, const State& state, const Configuration& c, const LoadPiece& piece,
                    const Vector3& value, Local& out) {
  const int edge = piece.edge;
  const EdgeFrame<double>& f = c.edge[at(edge)];
  if (model.planar()) {
    const double m = value.dot(model.plane->normal), l = f.inverse_length;
    const double t[2] = {f.tangent.x, f.tangent.y}, n[2] = {-f.tangent.y * l, f.tangent.x * l};
    for (int i = 0; i < 2; ++i) {
      out.gradient[i] = m * n[i];
      out.gradient[2 + i] = -m * n[i];
      for (int j = 0; j < 2; ++j) {
        const double h = m * l * (t[i] * n[j] + n[i] * t[j]);
        out.hessian[i][j] = out.hessian[2 + i][2 + j] = h;
        out.hessian[i][2 + j] = out.hessian[2 + i][j] = -h;
      }
    }
    return;
  }
  const Vector3 t = to_eigen(f.tangent), spin = to_eigen(f.spin),
                M = piece.follower ? carried(model, f, edge, value) : value;
  const double l = f.inverse_length, along = M.dot(t);
  const Vector3 turn = l * M.cross(t), lateral = l * (M - along * t);
  const Vector3 force = turn + along * spin;
  Matrix3 D = l * l * cross_matrix(M) * (Matrix3::Identity() - t * t.transpose()) - l * turn * t.transpose() +
              spin * lateral.transpose() + along * spin_derivative(f, state.tangent[at(edge)]);
  Vector3 by_angle = Vector3::Zero(), torque = lateral;  // derivatives of the force by theta, of the torque by the edge
  if (piece.follower) {
    const Matrix3 A = l * cross_matrix(t) + t * spin.transpose();  // turn of the edge's frame by its vector
    const Matrix3 B = spin * t.transpose() - l * cross_matrix(t);  // force by moment
    D -= B * cross_matrix(M) * A;
    by_angle = B * t.cross(M);
    torque += A.transpose() * M.cross(t);
  }
  for (int i = 0; i < 3; ++i) {
    out.gradient[i] = force(i);
    out.gradient[4 + i] = -force(i);
    out.hessian[3][i] = torque(i);
    out.hessian[3][4 + i] = -torque(i);
    out.hessian[i][3] = by_angle(i);
    out.hessian[4 + i][3] = -by_angle(i);
    for (int j = 0; j < 3; ++j) {
      out.hessian[i][j] = out.hessian[4 + i][4 + j] = -D(i, j);
      out.hessian[i][4 + j] = out.hessian[4 + i][j] = D(i, j);
    }
  }
  out.gradient[3] = -along;
}

void moment_on_frame(const Model& model, const VectorX& q, const Configuration& configuration, const LoadPiece& piece,
                     const Vector3& value, Local& out) {
  if (model.planar()) {
    out.gradient[0] = -value.dot(model.plane->normal);
    return;
  }
  const Matrix3& frame = configuration.frame[at(piece.frame)];
  const Hinge* hinge = piece.hinge < 0 ? nullptr : &model.hinges[at(piece.hinge)];
  Vector3 M = value;
  if (piece.follower) M = frame * (hinge_turn(model, q, piece.hinge) * value);
  const Vector3 w = q.segment<3>(model.frame_dof[at(piece.frame)]);
  const double c = 1.0 / (1.0 + 0.25 * w.squaredNorm());
  const Vector3 u = M - 0.5 * w.cross(M);
  const Matrix3 J = cayley_spin(w);
  Matrix3 D = -0.5 * c * c * u * w.transpose() + 0.5 * c * cross_matrix(M);
  if (piece.follower) D -= J.transpose() * cross_matrix(M) * J;
  for (int i = 0; i < 3; ++i) {
    out.gradient[i] = -c * u(i);
    for (int j = 0; j < 3; ++j) out.hessian[i][j] = -D(i, j);
  }
  if (!hinge) return;
  const Vector3 axis = frame * hinge->axis, across = J.transpose() * axis.cross(M);
  out.gradient[3] = -axis.dot(M);
  for (int i = 0; i < 3; ++i) {
    if (piece.follower)
      out.hessian[i][3] = -across(i);
    else
      out.hessian[3][i] = -across(i);
  }
}

void follower(const Model& model, const Configuration& c, int edge, const Vector3& value, Local& out) {
  const EdgeFrame<double>& f = c.edge[at(edge)];
  const Vector3 F = carried(model, f, edge, value);
  const double l = f.inverse_length;
  if (model.planar()) {
    const Plane& plane = *model.plane;
    const double x[2] = {F.dot(plane.first), F.dot(plane.second)}, turned[2] = {-x[1], x[0]};
    const double n[2] = {-f.tangent.y * l, f.tangent.x * l};
    for (int i = 0; i < 2; ++i) {
      out.gradient[i] = -x[i];
      for (int j = 0; j < 2; ++j) {
        out.hessian[i][2 + j] = turned[i] * n[j];
        out.hessian[i][4 + j] = -turned[i] * n[j];
      }
    }
    return;
  }
  const Vector3 t = to_eigen(f.tangent), spin = to_eigen(f.spin);
  const Matrix3 D = -cross_matrix(F) * (l * cross_matrix(t) + t * spin.transpose());
  const Vector3 turned = t.cross(F);
  for (int i = 0; i < 3; ++i) {
    out.gradient[i] = -F(i);
    out.hessian[i][6] = -turned(i);
    for (int j = 0; j < 3; ++j) {
      out.hessian[i][3 + j] = D(i, j);
      out.hessian[i][7 + j] = -D(i, j);
    }
  }
}

/// Half of value x e on either node, with the potential (value / 2) . (x0 x x1).
void pressure_on_edge(const Model& model, const VectorX& q, int edge, const Vector3& value, Local& out) {
  const int n = model.dimension, tail = model.tail_dof[at(edge)], head = model.head_dof[at(edge)];
  Matrix3 X = 0.5 * cross_matrix(value);
  if (model.planar()) {
    const double p = 0.5 * value.dot(model.plane->normal);
    X << 0.0, -p, 0.0, p, 0.0, 0.0, 0.0, 0.0, 0.0;
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double e = q(head + j) - q(tail + j);
      out.gradient[i] -= X(i, j) * e;
      out.gradient[n + i] -= X(i, j) * e;
      out.hessian[i][j] = out.hessian[n + i][j] = X(i, j);
      out.hessian[i][n + j] = out.hessian[n + i][n + j] = -X(i, j);
      out.energy += q(head + i) * X(i, j) * q(tail + j);
    }
}

/// Edges on which a load at a place of a rod acts: edges of the rod, and edges that bend against them at this node,
/// such as the next rod in a row of rods.
std::vector<int> edges_at(const Model& model, const RodPass& pass) {
  const RodDescription& rod = model.description.rods[at(pass.rod)];
  const int first = model.rod_first_edge[at(pass.rod)], last = model.rod_first_edge[at(pass.rod) + 1] - 1;
  std::vector<int> edges;
  if (pass.node > 0 || rod.closed) edges.push_back(pass.node > 0 ? first + pass.node - 1 : last);
  if (first + pass.node <= last) edges.push_back(first + pass.node);
  const auto known = [&](int edge) { return std::find(edges.begin(), edges.end(), edge) != edges.end(); };
  for (const int b : model.bend_across) {
    const BendStencil& s = model.bend[at(b)];
    if (s.node[1] != rod.nodes[at(pass.node)] || known(s.edge[0]) == known(s.edge[1])) continue;
    edges.push_back(known(s.edge[0]) ? s.edge[1] : s.edge[0]);
  }
  return edges;
}

/// Adds custom moments. A moment acts on the frame of a joint at its node, preferably on a frame against which others
/// turn. Without a joint it acts evenly on the edges of the node.
void add_node_moments(const Model& model, Loads& loads) {
  loads.node_moments = model.node_count;
  std::vector<std::vector<int>> edges(at(model.node_count));
  for (int e = 0; e < model.edge_count; ++e)
    for (int node : {model.edge_tail[at(e)], model.edge_head[at(e)]}) edges[at(node)].push_back(e);
  std::vector<int> frame(at(model.node_count), -1);
  const auto turns = [&](int of) {
    return std::any_of(model.joint_angles.begin(), model.joint_angles.end(),
                       [&](const JointAngle& joint) { return joint.turning == model.frame_dof[at(of)]; });
  };
  for (const FrameStencil& half : model.half) {
    int& known = frame[at(model.frame_node[at(half.frame)])];
    if (half.hinge < 0 && (known < 0 || turns(known))) known = half.frame;
  }
  for (int node = 0; node < model.node_count; ++node) {
    if (frame[at(node)] >= 0) {
      loads.pieces.push_back({LoadShape::frame_moment, -1, 1.0, node, -1, frame[at(node)]});
      continue;
    }
    const double share = 1.0 / static_cast<double>(std::max<std::size_t>(edges[at(node)].size(), 1));
    for (int e : edges[at(node)]) loads.pieces.push_back({LoadShape::edge_moment, -1, share, node, e});
  }
}

}  // namespace

Loads resolve_loads(const Model& model) {
  Loads loads;
  const auto& scene = model.description;
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    const LoadDescription& load = scene.loads[k];
    const auto index = static_cast<int>(first_load_row(scene, k));
    const int stride = load.values.rows() > 1 ? 1 : 0;  // rows from one edge to the next
    if (load.pass.on_body()) {
      LoadPiece piece{.shape = LoadShape::dead_node, .load = index, .weight = 1.0, .node = load.pass.node};
      if (load.kind == LoadKind::moment) {
        piece.shape = LoadShape::frame_moment;
        piece.frame = model.body_frame[at(load.pass.body())];
      }
      loads.pieces.push_back(piece);
      continue;
    }
    const RodDescription& rod = scene.rods[at(load.pass.rod)];
    const int first = model.rod_first_edge[at(load.pass.rod)], last = model.rod_first_edge[at(load.pass.rod) + 1] - 1;
    if (load.kind == LoadKind::pressure) {
      for (int e = first; e <= last; ++e)
        loads.pieces.push_back({LoadShape::edge_pressure, index + stride * (e - first), 1.0, -1, e});
      if (!rod.closed) loads.unsymmetric = true;
    } else if (load.kind == LoadKind::distributed) {
      for (int e = first; e <= last; ++e)
        for (int node : {model.edge_tail[at(e)], model.edge_head[at(e)]})
          loads.pieces.push_back({.shape = load.follower ? LoadShape::follower : LoadShape::dead_node,
                                  .load = index + stride * (e - first),
                                  .weight = 0.5 * model.edge_arc(e),
                                  .node = node,
                                  .edge = e,
                                  .along = true});
    } else {
      const int node = rod.nodes[at(load.pass.node)];
      const std::vector<int> edges = edges_at(model, load.pass);
      const double share = 1.0 / static_cast<double>(edges.size());
      if (load.kind == LoadKind::force && !load.follower) {
        loads.pieces.push_back({LoadShape::dead_node, index, 1.0, node});
        continue;
      }
      if (load.kind == LoadKind::force) {
        for (int e : edges) loads.pieces.push_back({LoadShape::follower, index, share, node, e});
        continue;
      }
      const auto half = std::find_if(model.half.begin(), model.half.end(), [&](const FrameStencil& of) {
        return std::find(edges.begin(), edges.end(), of.edge) != edges.end() && model.frame_node[at(of.frame)] == node;
      });
      LoadPiece piece{.shape = LoadShape::frame_moment, .load = index, .weight = 1.0, .node = node};
      piece.follower = load.follower;
      if (half != model.half.end()) {
        piece.frame = half->frame;
        piece.hinge = half->hinge;
        loads.pieces.push_back(piece);
        continue;
      }
      piece.shape = LoadShape::edge_moment;
      piece.weight = share;
      for (int e : edges) {
        piece.edge = e;
        loads.pieces.push_back(piece);
      }
    }
  }
  if (scene.custom_moments) add_node_moments(model, loads);
  for (const LoadPiece& piece : loads.pieces)
    if (piece.shape == LoadShape::follower ||
        (!model.planar() && (piece.shape == LoadShape::edge_moment || piece.shape == LoadShape::frame_moment)))
      loads.unsymmetric = true;
  return loads;
}

bool has_potential(const Model& model, const LoadPiece& piece) {
  if (piece.shape == LoadShape::edge_pressure) return model.description.rods[at(model.edge_rod[at(piece.edge)])].closed;
  return piece.shape == LoadShape::dead_node;
}

int load_dofs(const Model& model, const LoadPiece& piece, int (&dofs)[kMaxLocal]) {
  const int d = model.dimension;
  int n = 0;
  const auto add = [&](int first, int count) {
    for (int i = 0; i < count; ++i) dofs[n++] = first + i;
  };
  if (piece.shape == LoadShape::dead_node || piece.shape == LoadShape::follower) add(model.node_dof[at(piece.node)], d);
  if (piece.shape == LoadShape::frame_moment) add(model.frame_dof[at(piece.frame)], model.frame_size());
  if (piece.hinge >= 0) add(model.hinges[at(piece.hinge)].dof, 1);
  if (piece.edge >= 0 && piece.shape != LoadShape::dead_node) {
    add(model.node_dof[at(model.edge_tail[at(piece.edge)])], d);
    if (!model.planar() && piece.shape != LoadShape::edge_pressure) add(model.edge_dof[at(piece.edge)], 1);
    add(model.node_dof[at(model.edge_head[at(piece.edge)])], d);
  }
  return n;
}

void load_local(const Model& model, const State& state, const VectorX& q, const Configuration& c,
                const LoadPiece& piece, const Vector3& load, Local& out) {
  int dofs[kMaxLocal];
  clear(out, load_dofs(model, piece, dofs));
  out.energy = 0.0;
  const Vector3 value = piece.weight * load;
  switch (piece.shape) {
    case LoadShape::dead_node:
      if (model.planar()) {
        out.gradient[0] = -value.dot(model.plane->first);
        out.gradient[1] = -value.dot(model.plane->second);
      } else {
        for (int i = 0; i < 3; ++i) out.gradient[i] = -value(i);
      }
      break;
    case LoadShape::follower:
      follower(model, c, piece.edge, value, out);
      break;
    case LoadShape::edge_moment:
      moment_on_edge(model, state, c, piece, value, out);
      break;
    case LoadShape::frame_moment:
      moment_on_frame(model, q, c, piece, value, out);
      break;
    case LoadShape::edge_pressure:
      pressure_on_edge(model, q, piece.edge, value, out);
      break;
  }
}

}  // namespace withe
