#include "model/actuation.hpp"

#include <algorithm>
#include <iterator>

#include "geometry/curvature.hpp"

namespace withe {

Actuation actuation_of(const Parameters& p) {
  return {p.natural_curvature, p.natural_twist, p.edge_natural_stretch, p.tendon_tension};
}

MatrixX3 drawn_strains(const MatrixX3& tangents, const MatrixX3& directors, bool closed) {
  const Eigen::Index edges = tangents.rows(), stencils = closed ? edges : edges - 1;
  const auto frame = [&](Eigen::Index edge) {
    const Vec3d t = to_vec3(Vector3(tangents.row(edge))), d = to_vec3(Vector3(directors.row(edge)));
    return EdgeFrame<double>{t, d, cross(t, d), 1.0, {}, {}};
  };
  MatrixX3 out(stencils, 3);
  for (Eigen::Index s = 0; s < stencils; ++s) {
    const Eigen::Index after = closed ? s : s + 1, before = after > 0 ? after - 1 : edges - 1;
    const BendTwistStrain<double> strain = bend_twist_strain(frame(before), frame(after), 0.0);
    out.row(s) << strain.kappa1, strain.kappa2, strain.tau;
  }
  return out;
}

Actuation relaxed_actuation(const Model& model, const Parameters& p, const Configuration& c) {
  Actuation out = actuation_of(p);
  out.tension.setZero();
  for (std::size_t r = 0; r < model.place.size(); ++r)
    for (std::size_t s = 0; s < model.place[r].size(); ++s) {
      const StencilPlace& place = model.place[r][s];
      const auto row = static_cast<Eigen::Index>(s);
      Vector2 turn = Vector2::Zero();
      double twist = 0.0, length = 0.0;
      const auto add = [&](const auto& strain, double voronoi) {
        const Vector2 bend =
            model.planar() ? Vector2(strain(0) * model.planar_components[r]) : Vector2(strain(0), strain(1));
        turn += voronoi * smooth_curvature(bend, voronoi);
        twist += model.planar() ? 0.0 : strain(2);
        length += voronoi;
      };
      const bool offset = place.bend >= 0 ? !model.bend_offset.row(place.bend).isZero(0.0)
                                          : std::any_of(std::begin(place.half), std::end(place.half), [&](int h) {
                                              return h >= 0 && !model.half_offset.row(h).isZero(0.0);
                                            });
      if (offset) continue;
      if (place.bend >= 0)
        add(c.bend_strain.row(place.bend), model.bend_voronoi(place.bend));
      else
        for (const int h : place.half)
          if (h >= 0) add(c.half_strain.row(h), model.half_voronoi(h));
      if (length == 0.0) continue;
      out.curvature[r].row(row) = turn / length;
      out.twist[r](row) = twist / length;
    }
  return out;
}

void set_actuation_between(const Model& model, const Actuation& from, const Actuation& to, double fraction,
                           Parameters& p) {
  const double rest = 1.0 - fraction;
  for (std::size_t r = 0; r < p.natural_curvature.size(); ++r) {
    p.natural_curvature[r] = rest * from.curvature[r] + fraction * to.curvature[r];
    p.natural_twist[r] = rest * from.twist[r] + fraction * to.twist[r];
  }
  p.edge_natural_stretch = rest * from.stretch + fraction * to.stretch;
  p.tendon_tension = rest * from.tension + fraction * to.tension;
  update_natural(model, p);
}

}  // namespace withe
