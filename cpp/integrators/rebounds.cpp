#include "integrators/rebounds.hpp"

#include <algorithm>
#include <cmath>

#include "common/check.hpp"

namespace withe {
namespace {

// Numbers of a column below this share of its greatest number have no effect.
constexpr double kNegligible = 1e-16;

}  // namespace

bool Rebounds::find(const Equations& equations) {
  contacts_.clear();
  if (const Contact* contact = equations.contact())
    contacts_ = rebound_contacts(contact->problem(), contact->contacts());
  return !contacts_.empty();
}

/// Shares contacts out among batches: in a batch, no two contacts have a component of the scene in common. One solution
/// of the system of masses then serves a whole batch.
void Rebounds::set_batches(const Model& model) {
  batches_.clear();
  std::vector<int> next(at(model.component_count), 0);
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    int batch = 0;
    const auto each_component = [&](const auto& use) {
      for (int dof : contacts_[i].dofs)
        if (dof >= 0) use(next[at(model.dof_component[at(dof)])]);
    };
    each_component([&](int& free) { batch = std::max(batch, free); });
    each_component([&](int& free) { free = batch + 1; });
    if (at(batch) == batches_.size()) batches_.emplace_back();
    batches_[at(batch)].push_back(i);
  }
}

/// Sets one row of each contact of a batch, and its column.
void Rebounds::set_rows(const Model& model, const std::vector<std::size_t>& batch, std::size_t k, MassSystem& masses) {
  row_.setZero(model.dof_count);
  owner_.assign(at(model.component_count), -1);
  for (std::size_t i : batch) {
    if (k > 0 && !(contacts_[i].friction > 0.0)) continue;
    for (int u = 0; u < kContactUnknowns; ++u) {
      const int dof = contacts_[i].dofs[u];
      if (dof < 0) continue;
      row_[dof] += contacts_[i].rows[k][u];
      owner_[at(model.dof_component[at(dof)])] = static_cast<int>(i);
    }
  }
  masses.fold(row_);
  column_ = row_;
  masses.solve(column_);
  const double least = kNegligible * column_.lpNorm<Eigen::Infinity>();
  for (int dof = 0; dof < model.dof_count; ++dof) {
    const int owner = owner_[at(model.dof_component[at(dof)])];
    if (owner < 0) continue;
    ReboundRows& rows = rows_[at(owner)];
    if (row_[dof] != 0.0) rows.row[k].entries.emplace_back(dof, row_[dof]);
    if (std::abs(column_[dof]) > least) rows.column[k].entries.emplace_back(dof, column_[dof]);
    rows.mobility[k] += row_[dof] * column_[dof];
  }
}

ReboundWork Rebounds::find_velocity(const Model& model, const State& state, double elastic, MassSystem& masses,
                                    VectorX& velocity) {
  velocity = state.v;
  find_rebounds(contacts_, rows_, elastic, velocity, impulses_);
  ReboundWork work;
  total_.setZero(model.dof_count);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      rows_[i].row[k].add_to(impulses_[i][k], total_);
      work.support_work -= impulses_[i][k] * contacts_[i].drift[k];
    }
  column_ = velocity - state.v;
  multiply(model, masses.mass(), column_, row_);
  masses.fold(row_);
  for (const Constraint& c : model.constraints)
    work.support_work += (c.held(row_) - c.held(total_)).dot(c.held(state.v));
  work.dissipated = kinetic_energy(model, masses.mass(), state.v) + work.support_work -
                    kinetic_energy(model, masses.mass(), velocity);
  return work;
}

ReboundWork Rebounds::apply(const Model& model, const Parameters& parameters, double lost, MassSystem& masses,
                            State& state) {
  require(masses.begin(state, parameters), "the masses of the scene must be positive");
  rows_.assign(contacts_.size(), ReboundRows{});
  set_batches(model);
  for (const std::vector<std::size_t>& batch : batches_)
    for (std::size_t k = 0; k < 3; ++k) set_rows(model, batch, k, masses);
  ReboundWork work = find_velocity(model, state, 1.0, masses, velocity_);
  if (const double gain = -work.dissipated - lost; gain > 0.0) {
    // All velocities between those with and without rebounds follow from impulses that contacts allow. The gain is a
    // convex parabola of the share of the rebound: g(s) = g0 + (g1 - g0 - k) s + k s^2.
    const ReboundWork least = find_velocity(model, state, 0.0, masses, least_);
    velocity_ -= least_;
    const double square = kinetic_energy(model, masses.mass(), velocity_), first = -least.dissipated - lost,
                 slope = gain - first - square, under = slope * slope - 4.0 * square * std::min(first, 0.0),
                 share = first < 0.0 ? 2.0 * -first / (slope + std::sqrt(under)) : 0.0;
    velocity_ = least_ + share * velocity_;
    work.support_work = least.support_work + share * (work.support_work - least.support_work);
    work.dissipated = -(first + share * (slope + share * square)) - lost;
    work.gain = std::max(first, 0.0) / kinetic_energy(model, masses.mass(), state.v);
  }
  state.v = velocity_;
  return work;
}

}  // namespace withe
