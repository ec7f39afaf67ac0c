#include "forces/loads.hpp"

#include <algorithm>

#include "common/check.hpp"
#include "geometry/rotation.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

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

void moment_on_edge(const Model& model, const State& state, const Configuration& c, int edge, const Vector3& M,
                    Local& out) {
  const EdgeFrame<double>& f = c.edge[at(edge)];
  if (model.planar()) {
    const double m = M.dot(model.plane->normal), l = f.inverse_length;
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
  const Vector3 t = to_eigen(f.tangent), spin = to_eigen(f.spin);
  const double l = f.inverse_length, along = M.dot(t);
  const Vector3 turn = l * M.cross(t), lateral = l * (M - along * t);
  const Vector3 force = turn + along * spin;
  const Matrix3 D = l * l * cross_matrix(M) * (Matrix3::Identity() - t * t.transpose()) - l * turn * t.transpose() +
                    spin * lateral.transpose() + along * spin_derivative(f, state.tangent[at(edge)]);
  for (int i = 0; i < 3; ++i) {
    out.gradient[i] = force(i);
    out.gradient[4 + i] = -force(i);
    out.hessian[3][i] = lateral(i);
    out.hessian[3][4 + i] = -lateral(i);
    for (int j = 0; j < 3; ++j) {
      out.hessian[i][j] = out.hessian[4 + i][4 + j] = -D(i, j);
      out.hessian[i][4 + j] = out.hessian[4 + i][j] = D(i, j);
    }
  }
  out.gradient[3] = -along;
}

void moment_on_frame(const Model& model, const VectorX& q, int frame, const Vector3& M, Local& out) {
  if (model.planar()) {
    out.gradient[0] = -M.dot(model.plane->normal);
    return;
  }
  const Vector3 w = q.segment<3>(model.frame_dof[at(frame)]);
  const double c = 1.0 / (1.0 + 0.25 * w.squaredNorm());
  const Vector3 u = M - 0.5 * w.cross(M);
  const Matrix3 D = -0.5 * c * c * u * w.transpose() + 0.5 * c * cross_matrix(M);
  for (int i = 0; i < 3; ++i) {
    out.gradient[i] = -c * u(i);
    for (int j = 0; j < 3; ++j) out.hessian[i][j] = -D(i, j);
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

}  // namespace

Loads resolve_loads(const Model& model) {
  Loads loads;
  const auto& scene = model.description;
  for (std::size_t k = 0; k < scene.loads.size(); ++k) {
    const LoadDescription& load = scene.loads[k];
    const int index = static_cast<int>(k);
    loads.values.push_back(load.value);
    const RodDescription& rod = scene.rods[at(load.pass.rod)];
    const int first = model.rod_first_edge[at(load.pass.rod)], last = model.rod_first_edge[at(load.pass.rod) + 1] - 1;
    if (load.kind == LoadKind::distributed) {
      for (int e = first; e <= last; ++e)
        for (int node : {model.edge_tail[at(e)], model.edge_head[at(e)]})
          loads.pieces.push_back(
              {load.follower ? LoadShape::follower : LoadShape::dead_node, index, 0.5 * model.edge_arc(e), node, e});
    } else {
      const int node = rod.nodes[at(load.pass.node)];
      const int count = last - first + 1;
      int in = load.pass.node > 0 ? first + load.pass.node - 1 : rod.closed ? last : -1;
      int out = load.pass.node < count ? first + load.pass.node : -1;
      if (load.kind == LoadKind::force) {
        loads.pieces.push_back(
            {load.follower ? LoadShape::follower : LoadShape::dead_node, index, 1.0, node, in >= 0 ? in : out});
      } else {
        require(!load.follower, "a moment cannot follow: give it in world axes, or as a function of time");
        int frame = -1;
        for (const FrameStencil& half : model.half)
          if (half.hinge < 0 && (half.edge == in || half.edge == out) && model.frame_node[at(half.frame)] == node)
            frame = half.frame;
        if (frame >= 0) {
          loads.pieces.push_back({LoadShape::frame_moment, index, 1.0, node, -1, frame});
        } else {
          const double share = in >= 0 && out >= 0 ? 0.5 : 1.0;
          for (int e : {in, out})
            if (e >= 0) loads.pieces.push_back({LoadShape::edge_moment, index, share, node, e});
        }
      }
    }
  }
  for (const LoadPiece& piece : loads.pieces)
    if (piece.shape == LoadShape::follower || (!model.planar() && piece.shape != LoadShape::dead_node))
      loads.unsymmetric = true;
  return loads;
}

int load_dofs(const Model& model, const LoadPiece& piece, int (&dofs)[kMaxLocal]) {
  const int d = model.dimension;
  int n = 0;
  const auto add = [&](int first, int count) {
    for (int i = 0; i < count; ++i) dofs[n++] = first + i;
  };
  if (piece.shape == LoadShape::dead_node || piece.shape == LoadShape::follower) add(model.node_dof[at(piece.node)], d);
  if (piece.shape == LoadShape::frame_moment) add(model.frame_dof[at(piece.frame)], model.frame_size());
  if (piece.shape == LoadShape::follower || piece.shape == LoadShape::edge_moment) {
    add(model.node_dof[at(model.edge_tail[at(piece.edge)])], d);
    if (!model.planar()) add(model.edge_dof[at(piece.edge)], 1);
    add(model.node_dof[at(model.edge_head[at(piece.edge)])], d);
  }
  return n;
}

void load_local(const Model& model, const State& state, const VectorX& q, const Configuration& c, const Loads& loads,
                const LoadPiece& piece, Local& out) {
  int dofs[kMaxLocal];
  clear(out, load_dofs(model, piece, dofs));
  out.energy = 0.0;
  const Vector3 value = piece.weight * loads.values[at(piece.load)];
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
      moment_on_edge(model, state, c, piece.edge, value, out);
      break;
    case LoadShape::frame_moment:
      moment_on_frame(model, q, piece.frame, value, out);
      break;
  }
}

}  // namespace withe
