#include <algorithm>
#include <cmath>

#include "contact/contact.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

using Dual14 = Dual<kContactUnknowns>;

}  // namespace

void Contact::values_at(const ContactPair& pair, const VectorX& q, double (&values)[kContactUnknowns]) const {
  std::fill(std::begin(values), std::end(values), 0.0);
  Vec3d x[4];
  end_points(pair, q, x);
  for (int i = 0; i < 4; ++i) {
    values[3 * i] = x[i].x;
    values[3 * i + 1] = x[i].y;
    values[3 * i + 2] = x[i].z;
  }
  if (model_.planar()) return;
  values[12] = q(model_.edge_dof[at(pair.key.a)]);
  if (pair.key.b >= 0) values[13] = q(model_.edge_dof[at(pair.key.b)]);
}

FrictionSetting Contact::setting(const Touching& t) const {
  const ContactDescription& contact = model_.description.contact;
  const ContactPair& pair = pairs_[at(t.pair)];
  FrictionSetting f;
  f.pair = &pair;
  if (pair.key.b < 0) f.obstacle = &surfaces_.obstacles()[at(-1 - pair.key.b)];
  f.points = t.points;
  f.contact_law = contact.law;
  f.law = contact.friction_law;
  f.stiffness = t.stiffness;
  f.yielded = t.yielded;
  f.tangential_stiffness = tangential_stiffness(pair, t.stiffness);
  f.rate = 7.5 / (contact.slip_tolerance * duration_);
  f.stick = t.stick;
  f.spatial = !model_.planar();
  f.centreline = contact.centreline_friction;
  values_at(pair, state_->q, f.start);
  if (!f.spatial) return f;
  f.source[0] = state_->tangent[at(pair.key.a)];
  if (pair.key.b >= 0) f.source[1] = state_->tangent[at(pair.key.b)];
  return f;
}

void Contact::add_friction(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = pairs_[at(t.pair)];
  const FrictionSetting f = setting(t);
  double now[kContactUnknowns];
  values_at(pair, q1_, now);
  if (!with_hessian) {
    friction_gradient(f, now, out.gradient);
    return;
  }
  Dual14 unknown[kContactUnknowns], gradient[kContactUnknowns];
  for (int i = 0; i < kContactUnknowns; ++i) unknown[i] = Dual14::unknown(now[i], i);
  friction_gradient(f, unknown, gradient);
  for (int i = 0; i < kContactUnknowns; ++i) {
    out.gradient[i] += gradient[i].value;
    for (int j = 0; j < kContactUnknowns; ++j) out.hessian[i][j] += gradient[i].slope[j];
  }
}

/// Columns of J at the start, where frames have not turned yet, for all that touches there.
void Contact::freeze() {
  frozen_.clear();
  const bool centreline = model_.description.contact.centreline_friction;
  for (const Touching& t : touching_) {
    const ContactPair& pair = pairs_[at(t.pair)];
    const double pressing = -t.energy.first;
    if (!(pair.friction > 0.0) || !(pressing > 0.0)) continue;
    Frozen frozen{};
    frozen.pressing = pressing;
    double w[4];
    end_weights(t.points.s, t.points.t, w);
    Vec3d x[4], column[kContactUnknowns] = {};
    end_points(pair, state_->q, x);
    const bool obstacle = pair.key.b < 0;
    const Vec3d axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < (obstacle ? 6 : 12); ++i) column[i] = w[i / 3] * axes[i % 3];
    for (int side = 0; side < (centreline ? 0 : obstacle ? 1 : 2); ++side) {
      const double sign = side == 0 ? 1.0 : -1.0;
      const Vec3d e = x[2 * side + 1] - x[2 * side];
      const double inverse = 1.0 / std::sqrt(dot(e, e));
      const Vec3d tangent = inverse * e;
      const Vec3d arm = (-sign * (side == 0 ? pair.radius_a : pair.radius_b)) * t.normal;
      for (int k = 0; k < 3; ++k) {
        const Vec3d turned = (sign * inverse) * cross(cross(tangent, axes[k]), arm);
        column[6 * side + 3 + k] += turned;
        column[6 * side + k] -= turned;
      }
      if (!model_.planar()) column[12 + side] = sign * cross(tangent, arm);
    }
    for (int i = 0; i < kContactUnknowns; ++i) {
      const Vec3d c = column[i] - dot(column[i], t.normal) * t.normal;
      frozen.slip[0][i] = c.x;
      frozen.slip[1][i] = c.y;
      frozen.slip[2][i] = c.z;
    }
    lagged_.push_back(t);
    lagged_.back().frozen = static_cast<int>(frozen_.size());
    lagged_.back().energy = ContactEnergy{};
    frozen_.push_back(frozen);
  }
}

/// How far the surfaces have slipped, with J of the start.
Vec3d Contact::frozen_slip(const Touching& t) const {
  const ContactPair& pair = pairs_[at(t.pair)];
  const Frozen& frozen = frozen_[at(t.frozen)];
  double now[kContactUnknowns], before[kContactUnknowns];
  values_at(pair, q1_, now);
  values_at(pair, state_->q, before);
  Vec3d slip{};
  for (int i = 0; i < kContactUnknowns; ++i)
    slip += (now[i] - before[i]) * Vec3d{frozen.slip[0][i], frozen.slip[1][i], frozen.slip[2][i]};
  return slip;
}

/// Friction of the step, for the records of contacts that still press at its end.
void Contact::record_frozen(std::vector<ContactRecord>& records) const {
  const double rate = 7.5 / (model_.description.contact.slip_tolerance * duration_);
  for (const Touching& t : touching_) {
    if (t.frozen < 0) continue;
    const ContactPair& pair = pairs_[at(t.pair)];
    ContactRecord* record = find_record(records, pair.key);
    if (record == nullptr) continue;
    const Vec3d slip = frozen_slip(t);
    const double square = dot(slip, slip);
    const double limit = pair.friction * frozen_[at(t.frozen)].pressing;
    record->friction = (-limit * slip_factor(Dual<1>(square), rate).value) * slip;
    record->sticking = rate * std::sqrt(square) < 7.5;
  }
}

void Contact::add_frozen_friction(const Touching& t, bool with_hessian, ContactLocal& out) const {
  const ContactPair& pair = pairs_[at(t.pair)];
  const Frozen& frozen = frozen_[at(t.frozen)];
  const ContactDescription& contact = model_.description.contact;
  const Vec3d slipped = frozen_slip(t);
  const double slip[3] = {slipped.x, slipped.y, slipped.z};
  const double square = dot(slipped, slipped);
  const Dual<1> factor = slip_factor(Dual<1>::unknown(square, 0), 7.5 / (contact.slip_tolerance * duration_));
  const double limit = pair.friction * frozen.pressing;
  double back[3][kContactUnknowns];  // derivative of the force by the unknowns
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < kContactUnknowns; ++i) {
      double along = 0.0;
      for (int l = 0; l < 3; ++l) along += slip[l] * frozen.slip[l][i];
      back[k][i] = limit * (factor.value * frozen.slip[k][i] + 2.0 * factor.slope[0] * slip[k] * along);
      out.gradient[i] += frozen.slip[k][i] * limit * factor.value * slip[k];
    }
  if (!with_hessian) return;
  for (int i = 0; i < kContactUnknowns; ++i)
    for (int j = 0; j < kContactUnknowns; ++j)
      for (int k = 0; k < 3; ++k) out.hessian[i][j] += frozen.slip[k][i] * back[k][j];
}

}  // namespace withe
