// Discrete gradients of single stencils: what they must keep, and their derivatives, in space and in a plane, over
// drawn steps.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "elasticity/discrete_elements.hpp"
#include "stencil_kinds.hpp"

namespace withe {
namespace {

using testing::Case;
using testing::count_of;
using testing::dofs_of;
using testing::Kind;
using testing::kKinds;
using testing::MatrixX;

/// A step from the state of a case to where the middle is z.
struct Step {
  const Case& c;
  ElasticCoefficients k;
  Configuration start, middle, end;
  VectorX end_q, change;

  explicit Step(const Case& of) : c(of) {
    set_elastic(initial_parameters(c.model), k);
    compute_configuration(c.model, c.state, c.state.q, start);
    move_middle(0.5 * (c.state.q + c.q));
  }
  void move_middle(const VectorX& z) {
    end_q = 2.0 * z - c.state.q;
    change = end_q - c.state.q;
    compute_configuration(c.model, c.state, z, middle);
    compute_configuration(c.model, c.state, end_q, end);
  }
  Local local(Kind kind, int i, bool with_matrix, const double* given_force = nullptr) const {
    const DiscreteStep step{start, middle, end, end_q, change};
    Local out;
    for (double& number : out.gradient) number = NAN;
    for (auto& row : out.hessian)
      for (double& number : row) number = NAN;
    if (kind == Kind::stretch) discrete_stretch_local(c.model, k, step, i, with_matrix, given_force, out);
    if (kind == Kind::bend) discrete_bend_local(c.model, bend_coefficients(k, i), step, i, with_matrix, out);
    if (kind == Kind::half) discrete_half_local(c.model, half_coefficients(k, i), step, i, with_matrix, out);
    return out;
  }
  double energy(Kind kind, int i, const Configuration& at_q) const {
    if (kind == Kind::stretch) return stretch_energy_of(c.model, k, at_q, i);
    const BendTwistEnergy e = kind == Kind::bend ? bend_energy_of(k, at_q, i) : half_energy_of(k, at_q, i);
    return e.bend + e.twist;
  }
  /// Displacements over which the forces do their work. For an angle this is 2 tan(D / 2). For an edge's angle it is
  /// divided by the part of the mean tangent along the middle tangent. For a frame it is its Cayley vector.
  VectorX way() const {
    VectorX out = change;
    const auto turn = [&](int dof) { return 2.0 * std::tan(0.5 * change(dof)); };
    const Model& m = c.model;
    for (int e = 0; !m.planar() && e < m.edge_count; ++e) {
      const Vec3d mean = 0.5 * (start.edge[at(e)].tangent + end.edge[at(e)].tangent);
      out(m.edge_dof[at(e)]) = turn(m.edge_dof[at(e)]) / dot(mean, middle.edge[at(e)].tangent);
    }
    for (int f = 0; m.planar() && f < m.frame_count; ++f) out(m.frame_dof[at(f)]) = turn(m.frame_dof[at(f)]);
    return out;
  }
};

TEST(DiscreteElements, DoTheWorkThatTheEnergyChangesBy) {
  for (const Case& c : testing::all_cases()) {
    const Step step(c);
    const VectorX way = step.way();
    for (Kind kind : kKinds)
      for (int i = 0; i < count_of(c.model, kind); ++i) {
        const Local local = step.local(kind, i, false);
        const std::vector<int> dofs = dofs_of(c.model, kind, i);
        double work = 0.0, magnitude = 0.0;
        for (std::size_t a = 0; a < dofs.size(); ++a) {
          if (dofs[a] < 0) continue;
          const double along = local.gradient[a] * way(dofs[a]);
          work += along;
          magnitude += std::abs(along);
        }
        const double e0 = step.energy(kind, i, step.start), e1 = step.energy(kind, i, step.end);
        if (!c.model.planar() && kind != Kind::stretch) {
          // Direct transport makes forces of torques (torque times spin), which do no work in a step.
          const auto without = [&](int edge, int tail, int head, int angle) {
            for (int x = 0; x < 3; ++x) {
              const double f = local.gradient[angle] * step.middle.edge[at(edge)].spin[x];
              work -= f * (way(dofs[at(head + x)]) - way(dofs[at(tail + x)]));
            }
          };
          if (kind == Kind::half) {
            without(c.model.half[at(i)].edge, 0, 4, 3);
          } else {
            const BendStencil& s = c.model.bend[at(i)];
            for (int k = 0; k < 2; ++k) {
              const int first = 4 * k, second = first + 4;
              without(s.edge[k], s.sign[k] > 0 ? first : second, s.sign[k] > 0 ? second : first, first + 3);
            }
          }
        }
        EXPECT_NEAR(work, e1 - e0, 1e-13 * (magnitude + e0 + e1))
            << c.name << ", " << testing::name_of(kind) << " " << i;
      }
  }
}

TEST(DiscreteElements, DerivativesByTheMiddleAreExact) {
  for (const Case& c : testing::all_cases()) {
    for (Kind kind : kKinds)
      for (int i = 0; i < count_of(c.model, kind); ++i) {
        const std::vector<int> all = dofs_of(c.model, kind, i);
        std::vector<std::size_t> slot;
        for (std::size_t a = 0; a < all.size(); ++a)
          if (all[a] >= 0) slot.push_back(a);
        const auto n = static_cast<Eigen::Index>(slot.size());
        const VectorX z = 0.5 * (c.state.q + c.q);
        const auto forces = [&](const VectorX& x) {
          VectorX moved = z, out(n);
          for (Eigen::Index a = 0; a < n; ++a) moved(all[slot[static_cast<std::size_t>(a)]]) = x(a);
          Step step(c);
          step.move_middle(moved);
          const Local local = step.local(kind, i, false);
          for (Eigen::Index a = 0; a < n; ++a) out(a) = local.gradient[slot[static_cast<std::size_t>(a)]];
          return out;
        };
        const Local local = Step(c).local(kind, i, true);
        VectorX x(n);
        MatrixX J(n, n);
        for (Eigen::Index a = 0; a < n; ++a) {
          const std::size_t r = slot[static_cast<std::size_t>(a)];
          x(a) = z(all[r]);
          for (Eigen::Index b = 0; b < n; ++b) J(a, b) = local.hessian[r][slot[static_cast<std::size_t>(b)]];
        }
        const VectorX alone = forces(x);
        for (Eigen::Index a = 0; a < n; ++a) EXPECT_EQ(alone(a), local.gradient[slot[static_cast<std::size_t>(a)]]);
        EXPECT_TRUE(testing::derivative_matches(forces, x, J, c.increment))
            << c.name << ", " << testing::name_of(kind) << " " << i;
      }
  }
}

TEST(DiscreteElements, TakeTheAxialForceThatIsGivenIntoTheMatrixAlone) {
  for (const Case& c : testing::all_cases()) {
    const Step step(c);
    const VectorX none = VectorX::Zero(c.model.edge_count);
    const int n = c.model.dimension;
    for (int e = 0; e < c.model.edge_count; ++e) {
      const Local own = step.local(Kind::stretch, e, true), given = step.local(Kind::stretch, e, true, none.data());
      const Vec3d& t = step.end.edge[at(e)].tangent;
      for (int i = 0; i < n; ++i) {
        EXPECT_EQ(own.gradient[i], given.gradient[i]);
        for (int j = 0; j < n; ++j) {
          const double mean = 2.0 * step.middle.length[e] / (step.start.length[e] + step.end.length[e]) *
                              step.middle.edge[at(e)].tangent[i];
          const double stiff = step.k.stretch_stiffness[e] / c.model.edge_length[e];
          EXPECT_NEAR(given.hessian[i][j], stiff * mean * t[j], 1e-13 * stiff) << c.name;
        }
      }
    }
  }
}

}  // namespace
}  // namespace withe
