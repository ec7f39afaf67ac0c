#include "steps/carried_parts.hpp"

#include <cmath>

#include "common/dual.hpp"

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

/// A node of a body in space, by the base and by w at z. `start`: its arm at the start of the step.
struct SpaceNode {
  static constexpr int kOwn = 3, kBody = 6;
  BodyRule rule;
  Vec3d start;

  template <class Scalar>
  Vec3<Scalar> lever(const Vec3<Scalar>& w) const {
    const Vec3<Scalar> a = constant<Scalar>(start);
    if (!rule.in_middle) return turned(w, a);
    return Scalar(0.5) * (a + turned(Scalar(2.0) * w, a));
  }
  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const Vec3<Scalar> arm = lever(Vec3<Scalar>{body[3], body[4], body[5]});
    for (int i = 0; i < 3; ++i) own[i] = body[i] + arm[i];
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    const Vec3<Scalar> w{body[3], body[4], body[5]};
    const Vec3<Scalar> moment = cross(lever(w), constant<Scalar>({force[0], force[1], force[2]}));
    const Vec3<Scalar> row = rule.are_moments ? moment : row_of_moment(w, moment);
    for (int i = 0; i < 3; ++i) {
      rows[i] = Scalar(force[i]);
      rows[3 + i] = row[i];
    }
  }
};

/// The same in a plane, by the base and the angle at z.
struct PlaneNode {
  static constexpr int kOwn = 2, kBody = 3;
  BodyRule rule;
  double arm[2], start_angle;

  template <class Scalar>
  Vec3<Scalar> turned_arm(const Scalar& angle) const {
    const double c = std::cos(value_of(angle)), s = std::sin(value_of(angle));
    const Scalar cosine = chain(angle, c, -s), sine = chain(angle, s, c);
    return {arm[0] * cosine - arm[1] * sine, arm[0] * sine + arm[1] * cosine, Scalar(0.0)};
  }
  template <class Scalar>
  Vec3<Scalar> lever(const Scalar& angle) const {
    if (!rule.in_middle) return turned_arm(angle);
    return Scalar(0.5) * (turned_arm(Scalar(start_angle)) + turned_arm(Scalar(2.0 * angle - start_angle)));
  }
  template <class Scalar>
  void place(const Scalar (&body)[kBody], Scalar (&own)[kOwn]) const {
    const Vec3<Scalar> at = lever(body[2]);
    own[0] = body[0] + at.x;
    own[1] = body[1] + at.y;
  }
  template <class Scalar>
  void act(const Scalar (&body)[kBody], const double (&force)[kOwn], Scalar (&rows)[kBody]) const {
    const Vec3<Scalar> at = lever(body[2]);
    rows[0] = Scalar(force[0]);
    rows[1] = Scalar(force[1]);
    rows[2] = at.x * force[1] - at.y * force[0];
  }
};

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
  /// Change of the Cayley vector by the turn about the hinge, over this turn.
  template <class Scalar>
  Vec3<Scalar> arm(const Vec3<Scalar>& w, const Scalar& turn) const {
    const double v = value_of(turn), t = std::tan(0.5 * v);
    const bool little = std::abs(v) < 1e-4;
    const Scalar tangent = chain(turn, t, 0.5 * (1.0 + t * t));
    const Scalar factor = chain(turn, little ? 1.0 + v * v / 12.0 : 2.0 * t / v,
                                little ? v / 6.0 : ((1.0 + t * t) * v - 2.0 * t) / (v * v));
    const Vec3<Scalar> n = constant<Scalar>(axis), x = Scalar(0.5) * w;
    const Scalar along = dot(x, n);
    return (factor / (1.0 - along * tangent)) * (n + cross(x, n) + along * x);
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
  if (model.planar())
    return use(PlaneNode{rule,
                         {part.arm.dot(model.plane->first), part.arm.dot(model.plane->second)},
                         problem.start->q[model.frame_dof[at(part.frame)]]});
  use(SpaceNode{rule, to_vec3(problem.start->frame[at(part.frame)] * part.arm)});
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

void fold_rows(const StepProblem& problem, const VectorX& z, VectorX& rows, VectorX& magnitude,
               std::vector<Carrying>& carrying) {
  const std::vector<CarriedPart>& carried = problem.model.carried;
  carrying.resize(carried.size());
  for (std::size_t i = carried.size(); i-- > 0;) {  // parts of parts first
    const CarriedPart& part = carried[i];
    with_kind(problem, part, [&]<class Kind>(const Kind& kind) {
      double body[Kind::kBody], force[Kind::kOwn], acting[Kind::kBody];
      gather(part, z, body);
      for (int k = 0; k < Kind::kOwn; ++k) force[k] = rows[part.own_dof + k];
      find_carrying(kind, body, force, acting, carrying[i]);
      for (int b = 0; b < Kind::kBody; ++b) {
        const int dof = part.body_dofs[at(b)];
        rows[dof] += acting[b];
        for (int k = 0; k < Kind::kOwn; ++k)
          magnitude[dof] += std::abs(carrying[i].act(b, k)) * magnitude[part.own_dof + k];
      }
      rows.segment(part.own_dof, Kind::kOwn).setZero();
      magnitude.segment(part.own_dof, Kind::kOwn).setZero();
    });
  }
}

void expand_step(const Model& model, const std::vector<Carrying>& carrying, VectorX& step) {
  for (std::size_t i = 0; i < carrying.size(); ++i) {
    const CarriedPart& part = model.carried[i];
    for (int k = 0; k < part.own_size; ++k) {
      double sum = 0.0;
      for (std::size_t b = 0; b < part.body_dofs.size(); ++b)
        sum += carrying[i].follow(k, static_cast<Eigen::Index>(b)) * step[part.body_dofs[b]];
      step[part.own_dof + k] = sum;
    }
  }
}

}  // namespace withe
