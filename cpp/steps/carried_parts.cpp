#include "steps/carried_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/dual.hpp"
#include "common/hypotenuse.hpp"
#include "elasticity/discrete_elements.hpp"
#include "geometry/rotation.hpp"

namespace withe {
namespace {

/// Rule of a step for bodies.
struct BodyRule {
  bool in_middle;    ///< z is the middle of the step
  bool are_moments;  ///< rows of frames are moments
};

BodyRule rule_of(const StepProblem& problem) { return {problem.in_middle(), problem.conserves_energy()}; }

template <class Scalar>
Vec3<Scalar> constant(const Vec3d& a) {
  return {Scalar(a.x), Scalar(a.y), Scalar(a.z)};
}

/// cay(w) a = a + (w x a + w x (w x a) / 2) / (1 + w^2 / 4).
template <class Scalar>
Vec3<Scalar> turned(const Vec3<Scalar>& w, const Vec3<Scalar>& a) {
  const Vec3<Scalar> across = cross(w, a);
  return a + (1.0 / (1.0 + 0.25 * dot(w, w))) * (across + Scalar(0.5) * cross(w, across));
}

/// Row of a frame by a moment: S(w)^T m with S = (I + w^ / 2) / (1 + w^2 / 4).
template <class Scalar>
Vec3<Scalar> row_of_moment(const Vec3<Scalar>& w, const Vec3<Scalar>& moment) {
  return (1.0 / (1.0 + 0.25 * dot(w, w))) * (moment - Scalar(0.5) * cross(w, moment));
}

/// The moment of a row: S(w)^-T r.
template <class Scalar>
Vec3<Scalar> moment_of_row(const Vec3<Scalar>& w, const Vec3<Scalar>& row) {
  return row + Scalar(0.5) * cross(w, row) + (Scalar(0.25) * dot(w, row)) * w;
}

/// The frame of a body on a hinge, by the frame that carries it and the angle at z. `axis`: at the start of the step.
struct HingedFrame {
  static constexpr int kOwn = 3, kBody = 4;
  BodyRule rule;
  Vec3d axis;
  double start_angle;

  /// Turn of a step about the hinge.
  template <class Scalar>
  Scalar turn(const Scalar& angle) const {
    return (rule.in_middle ? 2.0 : 1.0) * (angle - start_angle);
  }
  /// Composition of rotations by Rodrigues' vectors w / 2: first about the axis, then with the body that carries.
  template <class Scalar>
  Vec3<Scalar> whole(const Vec3<Scalar>& w, const Scalar& turn) const {
    const double t = std::tan(0.5 * value_of(turn));
    const Scalar tangent = chain(turn, t, 0.5 * (1.0 + t * t));
    const Vec3<Scalar> a = Scalar(0.5) * w, b = tangent * constant<Scalar>(axis);
    return (2.0 / (1.0 - dot(a, b))) * (a + b + cross(a, b));
  }
  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const double rate = rule.in_middle ? 2.0 : 1.0;
    const Vec3<Scalar> w = Scalar(rate) * Vec3<Scalar>{body[0], body[1], body[2]};
    const Vec3<Scalar> out = Scalar(1.0 / rate) * whole(w, turn(body[3]));
    for (int i = 0; i < 3; ++i) own[i] = out[i];
  }
  /// Change of the Cayley vector by the turn about the hinge, over this turn, with the derivatives of `hinge_arm`.
  template <class Scalar>
  Vec3<Scalar> arm(const Vec3<Scalar>& w, const Scalar& turn) const {
    const Vector3 at(value_of(w.x), value_of(w.y), value_of(w.z));
    const HingeArm h = hinge_arm(at, to_eigen(axis), value_of(turn));
    const Vec3<Scalar> apart = w - constant<Scalar>(to_vec3(at));
    const Scalar turned_on = turn - value_of(turn);
    const auto component = [&](int i) -> Scalar {
      return h.arm(i) + h.by_frame(i, 0) * apart.x + h.by_frame(i, 1) * apart.y + h.by_frame(i, 2) * apart.z +
             h.by_angle(i) * turned_on;
    };
    return {component(0), component(1), component(2)};
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    const Vec3<Scalar> w{body[0], body[1], body[2]};
    Vec3<Scalar> moment = constant<Scalar>({force[0], force[1], force[2]});
    if (!rule.are_moments) {
      Scalar own[kOwn];
      place(body, own);
      moment = moment_of_row(Vec3<Scalar>{own[0], own[1], own[2]}, moment);
    }
    const Vec3<Scalar> row = rule.are_moments ? moment : row_of_moment(w, moment);
    const Vec3<Scalar> by_angle =
        rule.in_middle ? arm(Scalar(2.0) * w, turn(body[3])) : turned(w, constant<Scalar>(axis));
    for (int i = 0; i < 3; ++i) rows[i] = row[i];
    rows[3] = dot(by_angle, moment);
  }
  void bound(const double (&force)[kOwn], double (&rows)[kBody]) const {
    const double sum = force[0] + force[1] + force[2];
    for (double& row : rows) row = sum;
  }
};

/// A node of a body in space, by the base, w and, if it is on a slide, its coordinate s at z. With L the mean of its
/// levers R (a + s n) at both ends, a step changes its lever exactly by
///   R1 (a + s1 n) - R0 (a + s0 n) = w x L + (n0 + w x n0 / 2) (s1 - s0),    n0 = R0 n.
template <bool slides>
struct SpaceNode {
  static constexpr int kOwn = 3, kBody = slides ? 7 : 6;
  BodyRule rule;
  Vec3d arm, axis;  ///< turned to the start of the step
  double start;     ///< coordinate at the start

  template <class Scalar>
  Vec3<Scalar> arm_at(const Scalar& s) const {
    return slides ? constant<Scalar>(arm) + s * constant<Scalar>(axis) : constant<Scalar>(arm);
  }
  template <class Scalar>
  Vec3<Scalar> lever(const Scalar (&body)[kBody]) const {
    const Vec3<Scalar> w{body[3], body[4], body[5]};
    const Scalar& s = body[kBody - 1];  // not used without a slide
    if (!rule.in_middle) return turned(w, arm_at(s));
    const Vec3<Scalar> end = turned(Scalar(2.0) * w, arm_at(Scalar(2.0 * s - start)));
    return Scalar(0.5) * (arm_at(Scalar(start)) + end);
  }
  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const Vec3<Scalar> at = lever(body);
    for (int i = 0; i < 3; ++i) own[i] = body[i] + at[i];
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    const Vec3<Scalar> w{body[3], body[4], body[5]};
    const Vec3<Scalar> f = constant<Scalar>({force[0], force[1], force[2]});
    const Vec3<Scalar> moment = cross(lever(body), f);
    const Vec3<Scalar> row = rule.are_moments ? moment : row_of_moment(w, moment);
    for (int i = 0; i < 3; ++i) {
      rows[i] = Scalar(force[i]);
      rows[3 + i] = row[i];
    }
    if constexpr (slides) {
      const Vec3<Scalar> n = constant<Scalar>(axis);
      rows[6] = dot(rule.in_middle ? n + cross(w, n) : turned(w, n), f);
    }
  }
  void bound(const double (&force)[kOwn], double (&rows)[kBody]) const {
    const double sum = force[0] + force[1] + force[2];
    const double length = std::sqrt(dot(arm, arm)) + std::abs(start);
    for (int i = 0; i < 3; ++i) {
      rows[i] = force[i];
      rows[3 + i] = length * sum;
    }
    if constexpr (slides) rows[6] = sum;
  }
};

/// The same in a plane, by the base, the angle and, on a slide, its coordinate at z.
template <bool slides>
struct PlaneNode {
  static constexpr int kOwn = 2, kBody = slides ? 4 : 3;
  BodyRule rule;
  std::array<double, 2> arm, axis;
  double start_angle, start;

  template <class Scalar>
  Vec3<Scalar> turned_by(const Scalar& angle, const Scalar& x, const Scalar& y) const {
    const double c = std::cos(value_of(angle)), s = std::sin(value_of(angle));
    const Scalar cosine = chain(angle, c, -s), sine = chain(angle, s, c);
    return {x * cosine - y * sine, x * sine + y * cosine, Scalar(0.0)};
  }
  template <class Scalar>
  Vec3<Scalar> arm_at(const Scalar& angle, const Scalar& s) const {
    if constexpr (!slides) return turned_by(angle, Scalar(arm[0]), Scalar(arm[1]));
    return turned_by(angle, Scalar(arm[0] + s * axis[0]), Scalar(arm[1] + s * axis[1]));
  }
  template <class Scalar>
  Vec3<Scalar> lever(const Scalar (&body)[kBody]) const {
    const Scalar &angle = body[2], &s = body[kBody - 1];  // the second is not used without a slide
    if (!rule.in_middle) return arm_at(angle, s);
    return Scalar(0.5) * (arm_at(Scalar(start_angle), Scalar(start)) +
                          arm_at(Scalar(2.0 * angle - start_angle), Scalar(2.0 * s - start)));
  }
  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const Vec3<Scalar> at = lever(body);
    own[0] = body[0] + at.x;
    own[1] = body[1] + at.y;
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    const Vec3<Scalar> at = lever(body);
    rows[0] = Scalar(force[0]);
    rows[1] = Scalar(force[1]);
    rows[2] = at.x * force[1] - at.y * force[0];
    if constexpr (slides) {
      Vec3<Scalar> along =
          turned_by(Scalar(rule.in_middle ? Scalar(start_angle) : body[2]), Scalar(axis[0]), Scalar(axis[1]));
      if (rule.in_middle) {
        // Half of the Cayley vector of the turn by 2 (angle - start).
        const Scalar half = body[2] - start_angle;
        const double t = std::tan(value_of(half));
        const Scalar tangent = chain(half, t, 1.0 + t * t);
        along = {along.x - tangent * along.y, along.y + tangent * along.x, Scalar(0.0)};
      }
      rows[3] = along.x * force[0] + along.y * force[1];
    }
  }
  void bound(const double (&force)[kOwn], double (&rows)[kBody]) const {
    rows[0] = force[0];
    rows[1] = force[1];
    rows[2] = (hypotenuse(arm[0], arm[1]) + std::abs(start)) * (force[0] + force[1]);
    if constexpr (slides) rows[3] = force[0] + force[1];
  }
};

/// The frame of a body on a slide turns as the frame that carries it.
template <int size>
struct SlidFrame {
  static constexpr int kOwn = size, kBody = size;

  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    for (int i = 0; i < size; ++i) own[i] = body[i];
  }
  template <class Scalar>
  void act(const Scalar (&)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    for (int i = 0; i < size; ++i) rows[i] = Scalar(force[i]);
  }
  void bound(const double (&force)[kOwn], double (&rows)[kBody]) const {
    for (int i = 0; i < size; ++i) rows[i] = force[i];
  }
};

/// The angle of an edge of the surface of a body. `tangent`: of the edge at the start of the step.
struct SurfaceAngle {
  static constexpr int kOwn = 1, kBody = 3;
  BodyRule rule;
  Vec3d tangent;
  double start_angle;

  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const Vec3<Scalar> w{body[0], body[1], body[2]};
    const double rate = rule.in_middle ? 2.0 : 1.0;
    const Scalar along = (0.5 * rate) * dot(w, constant<Scalar>(tangent));  // tangent of half the angle
    const double tan_half = value_of(along);
    own[0] = start_angle + (2.0 / rate) * chain(along, std::atan(tan_half), 1.0 / (1.0 + tan_half * tan_half));
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    using std::sqrt;
    const Vec3<Scalar> w{body[0], body[1], body[2]}, before = constant<Scalar>(tangent);
    Vec3<Scalar> now = turned(rule.in_middle ? Scalar(2.0) * w : w, before);
    if (rule.in_middle) {
      const Vec3<Scalar> sum = before + now;
      now = (1.0 / sqrt(dot(sum, sum))) * sum;
    }
    const Vec3<Scalar> moment = (force[0] / (1.0 + dot(before, now))) * (before + now);
    const Vec3<Scalar> row = rule.are_moments ? moment : row_of_moment(w, moment);
    for (int i = 0; i < 3; ++i) rows[i] = row[i];
  }
  void bound(const double (&force)[kOwn], double (&rows)[kBody]) const {
    for (double& row : rows) row = force[0];
  }
};

/// Calls use(part) with the carried part as one of the kinds above.
template <class Use>
void with_kind(const StepProblem& problem, const CarriedPart& part, const Use& use) {
  const Model& model = problem.model;
  const BodyRule rule = rule_of(problem);
  if (part.hinge >= 0) {
    const Hinge& hinge = model.hinges[at(part.hinge)];
    return use(
        HingedFrame{rule, to_vec3(problem.start->frame[at(part.frame)] * hinge.axis), problem.start->q[hinge.dof]});
  }
  if (part.edge >= 0)
    return use(SurfaceAngle{rule, problem.start->tangent[at(part.edge)], problem.start->q[part.own_dof]});
  if (!part.is_node()) return model.planar() ? use(SlidFrame<1>{}) : use(SlidFrame<3>{});
  const auto in_plane = [&](const Vector3& v) {
    return std::array{v.dot(model.plane->first), v.dot(model.plane->second)};
  };
  const Slide* slide = part.slide < 0 ? nullptr : &model.slides[at(part.slide)];
  const double start = slide ? problem.start->q[slide->dof] : 0.0;
  const Vector3 axis = slide ? slide->axis : Vector3(Vector3::Zero());
  if (model.planar()) {
    const double angle = problem.start->q[model.frame_dof[at(part.frame)]];
    if (slide) return use(PlaneNode<true>{rule, in_plane(part.arm), in_plane(axis), angle, start});
    return use(PlaneNode<false>{rule, in_plane(part.arm), in_plane(axis), angle, start});
  }
  const Matrix3& frame = problem.start->frame[at(part.frame)];
  const Vec3d arm = to_vec3(frame * part.arm);
  if (slide) return use(SpaceNode<true>{rule, arm, to_vec3(frame * axis), start});
  use(SpaceNode<false>{rule, arm, to_vec3(axis), start});
}

template <int size>
void gather(const CarriedPart& part, const VectorX& from, double (&out)[size]) {
  for (int i = 0; i < size; ++i) out[i] = from[part.body_dofs[at(i)]];
}

/// Derivatives of a part, with the force `force` on it, and the rows of its body.
template <class Kind>
void find_carrying(const Kind& kind, const double (&body)[Kind::kBody], const double (&force)[Kind::kOwn],
                   double (&rows)[Kind::kBody], Carrying& out) {
  using D = Dual<Kind::kBody>;
  D unknowns[Kind::kBody], own[Kind::kOwn], acting[Kind::kBody];
  for (int i = 0; i < Kind::kBody; ++i) unknowns[i] = D::unknown(body[i], i);
  kind.place(unknowns, own);
  kind.act(unknowns, force, acting);
  for (int i = 0; i < Kind::kBody; ++i) {
    rows[i] = acting[i].value;
    for (int k = 0; k < Kind::kBody; ++k) out.slope(i, k) = acting[i].slope[k];
    for (int k = 0; k < Kind::kOwn; ++k) out.follow(k, i) = own[k].slope[i];
  }
  for (int k = 0; k < Kind::kOwn; ++k) {
    double unit[Kind::kOwn] = {}, by[Kind::kBody];
    unit[k] = 1.0;
    kind.act(body, unit, by);
    for (int i = 0; i < Kind::kBody; ++i) out.act(i, k) = by[i];
  }
}

}  // namespace

void place_carried(const StepProblem& problem, VectorX& z) {
  for (const CarriedPart& part : problem.model.carried)
    with_kind(problem, part, [&]<class Kind>(const Kind& kind) {
      double body[Kind::kBody], own[Kind::kOwn];
      gather(part, z, body);
      kind.place(body, own);
      for (int i = 0; i < Kind::kOwn; ++i) z[part.own_dof + i] = own[i];
    });
}

namespace {

/// Calls use(kind, number, part) for each part, parts of parts first.
template <class Use>
void each_backwards(const StepProblem& problem, const Use& use) {
  const std::vector<CarriedPart>& carried = problem.model.carried;
  for (std::size_t i = carried.size(); i-- > 0;)
    with_kind(problem, carried[i], [&](const auto& kind) { use(kind, i, carried[i]); });
}

/// Calls find(kind, part, its body, the force on it, whether there is any, rows of the body) for each part.
template <class Find>
void fold(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude, const Find& find) {
  each_backwards(problem, [&]<class Kind>(const Kind& kind, std::size_t i, const CarriedPart& part) {
    double body[Kind::kBody], force[Kind::kOwn], acting[Kind::kBody] = {}, size[Kind::kOwn], bound[Kind::kBody];
    gather(part, z, body);
    for (int k = 0; k < Kind::kOwn; ++k) {
      force[k] = rows[part.own_dof + k];
      size[k] = magnitude[part.own_dof + k];
    }
    const bool pressed = std::any_of(force, force + Kind::kOwn, [](double f) { return f != 0.0; });
    find(kind, i, body, force, pressed, acting);
    kind.bound(size, bound);
    for (int b = 0; b < Kind::kBody; ++b) {
      const int dof = part.body_dofs[at(b)];
      rows[dof] += acting[b];
      magnitude[dof] += bound[b];
    }
    rows.segment(part.own_dof, Kind::kOwn).setZero();
    magnitude.segment(part.own_dof, Kind::kOwn).setZero();
  });
}

}  // namespace

void fold_rows(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude) {
  fold(problem, z, rows, magnitude,
       [&](const auto& kind, std::size_t, const auto& body, const auto& force, bool pressed, auto& acting) {
         if (pressed) kind.act(body, force, acting);
       });
}

void fold_rows(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude,
               std::vector<Carrying>& carrying) {
  carrying.resize(problem.model.carried.size());
  fold(problem, z, rows, magnitude,
       [&](const auto& kind, std::size_t i, const auto& body, const auto& force, bool pressed, auto& acting) {
         carrying[i].known = pressed;
         if (pressed) find_carrying(kind, body, force, acting, carrying[i]);
       });
}

void find_carrying(const StepProblem& problem, const VectorX& z, std::size_t i, Carrying& out) {
  const CarriedPart& part = problem.model.carried[i];
  with_kind(problem, part, [&]<class Kind>(const Kind& kind) {
    double body[Kind::kBody], acting[Kind::kBody];
    const double force[Kind::kOwn] = {};
    gather(part, z, body);
    find_carrying(kind, body, force, acting, out);
  });
  out.known = true;
}

void fold_matrix(const StepProblem& problem, const VectorX& z, std::vector<Carrying>& carrying, Assembler& assembler) {
  assembler.fold_carried([&](std::size_t i, bool needed) {
    Carrying& part = carrying[i];
    if (needed && !part.known) find_carrying(problem, z, i, part);
    return part.known ? &part : nullptr;
  });
}

// Share of bounds that bodies get. Bounds of contacts and their use in Newton's method have margins of 8 and 10.
// Contacts of sharp edges are so stiff that these margins would cost angular momentum; 2.5 units of rounding error are
// left.
constexpr double kCarriedShare = 1.0 / 32.0;

void fold_bounds(const StepProblem& problem, VectorX& bounds) {
  each_backwards(problem, [&]<class Kind>(const Kind& kind, std::size_t, const CarriedPart& part) {
    double size[Kind::kOwn], bound[Kind::kBody];
    for (int k = 0; k < Kind::kOwn; ++k) size[k] = bounds[part.own_dof + k];
    kind.bound(size, bound);
    for (int b = 0; b < Kind::kBody; ++b) bounds[part.body_dofs[at(b)]] += kCarriedShare * bound[b];
  });
}

void sum_rows(const StepProblem& problem, const VectorX& z, VectorX& rows) {
  each_backwards(problem, [&]<class Kind>(const Kind& kind, std::size_t, const CarriedPart& part) {
    double body[Kind::kBody], force[Kind::kOwn], acting[Kind::kBody];
    gather(part, z, body);
    for (int k = 0; k < Kind::kOwn; ++k) force[k] = rows[part.own_dof + k];
    kind.act(body, force, acting);
    for (int b = 0; b < Kind::kBody; ++b) rows[part.body_dofs[at(b)]] += acting[b];
  });
}

void expand_step(const StepProblem& problem, const VectorX& z, VectorX& step) {
  for (const CarriedPart& part : problem.model.carried)
    with_kind(problem, part, [&]<class Kind>(const Kind& kind) {
      Dual<1> body[Kind::kBody], own[Kind::kOwn];
      for (int b = 0; b < Kind::kBody; ++b) {
        const int dof = part.body_dofs[at(b)];
        body[b] = Dual<1>(z[dof]);
        body[b].slope[0] = step[dof];
      }
      kind.place(body, own);
      for (int k = 0; k < Kind::kOwn; ++k) step[part.own_dof + k] = own[k].slope[0];
    });
}

bool follow_held_bodies(const StepProblem& problem, const VectorX& z, VectorX& velocity) {
  const Model& model = problem.model;
  bool any = false;
  for (const CarriedPart& part : model.carried) {
    if (!part.is_held || !part.is_node()) continue;
    any = true;
    const int base = part.body_dofs.front(), frame = model.frame_dof[at(part.frame)];
    if (model.planar()) {
      const double angle = 2.0 * z[frame] - problem.start->q[frame], c = std::cos(angle), s = std::sin(angle);
      const double x = part.arm.dot(model.plane->first), y = part.arm.dot(model.plane->second);
      velocity.segment<2>(part.own_dof) =
          velocity.segment<2>(base) + velocity[frame] * Vector2(-(s * x + c * y), c * x - s * y);
    } else {
      const Vector3 arm = cayley(2.0 * z.segment<3>(frame)) * (problem.start->frame[at(part.frame)] * part.arm);
      const Vector3 spin = velocity.segment<3>(frame);
      velocity.segment<3>(part.own_dof) = velocity.segment<3>(base) + spin.cross(arm);
    }
  }
  return any;
}

}  // namespace withe
