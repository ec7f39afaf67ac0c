#include "run/separation.hpp"

#include <algorithm>
#include <cmath>

#include "integrators/dynamics.hpp"

namespace withe {
namespace {

// Steps of the descent, and how much stiffer contact is in each.
constexpr int kMaxSteps = 60;
constexpr double kStiffening = 4.0;

/// A quasi-static descent of elastic and contact energy, without friction, loads, tendons or weight. It takes steps of
/// backward Euler from rest, with a mass that makes the steps long compared with the rods' slowest modes. Contact
/// becomes stiffer until nothing overlaps. Supports hold.
class Separation {
 public:
  Separation(const Model& model, const Parameters& parameters, const Options& options, const State& start)
      : model_(without_loads(model)),
        parameters_(massive(model_, parameters)),
        options_(descent(options)),
        newton_(model_, options_),
        equations_(model_, equation_options(options_)),
        state_(start),
        barred_(model.description.contact.law == ContactLaw::barrier) {
    contact().allow_depth(INFINITY);
    soft_ = 100.0 * (parameters_.edge_bend.rowwise().maxCoeff().array() / model_.edge_arc.array().cube()).minCoeff() *
            std::pow(1.0 / model_.edge_count, 3.0);
    stiff_ = 100.0 * (parameters_.edge_stretch.array() / model_.edge_arc.array()).maxCoeff();
  }

  /// True if something overlapped. In `state` it then overlaps no more, or less.
  bool run(State& state) {
    if (overlap() <= 0.0) return false;
    nudge();
    double stiffness = soft_, dt = 1.0;
    for (int k = 0; k < kMaxSteps && overlap() > 0.0; ++k) {
      state_.contacts.clear();
      state_.contact_stiffness.setConstant(state.contact_stiffness.size(), stiffness);
      state_.v.setZero();
      predictor_.clear();
      prescribed_.held.q = state_.q;
      work_.newton.matrix = MatrixRecord{};
      work_.newton.guesses = GuessRecords{};
      const bool done = implicit_step(equations_, newton_, options_, parameters_, prescribed_,
                                      {StepRule::backward_euler, dt, 0}, state_, predictor_, work_)
                            .accepted;
      dt = done ? 1.0 : 0.25 * dt;
      if (done) stiffness = std::min(kStiffening * stiffness, stiff_);
    }
    state_.v.setZero();
    state_.acceleration.setZero();
    state_.contacts.clear();
    state_.contact_stiffness = state.contact_stiffness;
    state_.time = state.time;
    state = state_;
    return true;
  }

 private:
  static Model without_loads(Model model) {
    SceneDescription& scene = model.description;
    scene.loads.clear();
    scene.tendons.clear();
    scene.fluid = FluidDescription{};
    ContactDescription& contact = scene.contact;
    contact.friction = 0.0;
    contact.obstacle_friction.setZero();
    contact.obstacle_rolling.setZero();
    for (ContactPairDescription& pair : contact.pairs) {
      pair.friction.setZero();
      pair.stiffness = 0.0;
    }
    contact.law = ContactLaw::imcv2;  // finite where surfaces overlap
    contact.stiffness = 1.0;          // given: each step sets it
    return model;
  }

  /// Inertia over a step of 1 s resists like the bending of a whole rod.
  static Parameters massive(const Model& model, Parameters p) {
    for (int e = 0; e < model.edge_count; ++e) {
      const int rod = model.edge_rod[at(e)];
      const int first = model.rod_first_edge[at(rod)], count = model.rod_first_edge[at(rod) + 1] - first;
      const double length = model.edge_arc.segment(first, count).sum();
      p.edge_density(e) = p.edge_bend.row(e).maxCoeff() / std::pow(length, 4.0);
      p.edge_rotary(e) = p.edge_density(e) * model.edge_arc(e) * model.edge_arc(e);
    }
    p.edge_drag.setZero();
    p.edge_viscous_time.setZero();
    p.added_mass.setZero();
    p.gravity.setZero();
    set_contact(model.description.contact, p);
    update_derived(model, p);
    return p;
  }

  static Options descent(Options options) {
    options.integrator = Integrator::backward_euler;
    options.tolerance.reset();
    options.time_step = 1.0;
    options.step_tolerance = 1e-7;
    return options;
  }

  Contact& contact() { return *equations_.contact(); }

  /// Greatest depth of two surfaces in each other [m]; a barrier wants them to be a little apart.
  double overlap() {
    double deepest = 0.0;
    for (const ContactReport& r : contact().report(state_, parameters_))
      deepest = std::max(deepest, (barred_ ? 1e-2 * contact().surfaces().tolerance(r.key.a) : 0.0) - r.gap);
    return deepest;
  }

  /// Centrelines that cross do not know which way to go: they leave each other along their common normal.
  void nudge() {
    VectorX move = VectorX::Zero(state_.q.size());
    for (const ContactReport& r : contact().report(state_, parameters_)) {
      if (r.key.b < 0) continue;
      const Vec3d a0 = tail(r.key.a), b0 = tail(r.key.b), u = head(r.key.a) - a0, v = head(r.key.b) - b0;
      const Vec3d between = a0 + r.s * u - b0 - r.t * v;
      const double apart = 1e-2 * (contact().surfaces().radius(r.key.a) + contact().surfaces().radius(r.key.b));
      if (dot(between, between) > apart * apart) continue;
      const Vec3d way = (0.5 * apart) * common_normal(u, v);
      for (const auto& [edge, sign] : {std::pair(r.key.a, 1.0), std::pair(r.key.b, -1.0)})
        for (int dof : {model_.tail_dof[at(edge)], model_.head_dof[at(edge)]}) {
          const double component[3] = {way.x, way.y, way.z};
          for (int k = 0; k < model_.dimension; ++k) move(dof + k) = sign * component[k];
        }
    }
    equations_.assembler().project(move);
    state_.q += move;
  }

  Vec3d tail(int edge) const { return local_position(model_, state_.q, model_.edge_tail[at(edge)]); }
  Vec3d head(int edge) const { return local_position(model_, state_.q, model_.edge_head[at(edge)]); }

  Vec3d common_normal(const Vec3d& u, const Vec3d& v) const {
    if (model_.planar()) return (1.0 / std::sqrt(dot(u, u))) * Vec3d{-u.y, u.x, 0.0};
    Vec3d normal = cross(u, v);
    const double scale = std::sqrt(dot(u, u) * dot(v, v));
    if (dot(normal, normal) < 1e-12 * scale * scale)
      normal = cross(u, std::abs(u.x) < std::abs(u.z) ? Vec3d{1, 0, 0} : Vec3d{0, 0, 1});
    return (1.0 / std::sqrt(dot(normal, normal))) * normal;
  }

  Model model_;
  Parameters parameters_;
  Options options_;
  Newton newton_;
  Equations equations_;
  State state_;
  bool barred_ = false;
  Predictor predictor_;
  StepWorkspace work_;
  Prescribed prescribed_;
  double soft_ = 0, stiff_ = 0;  ///< stiffness of contact at first and at most [N/m]
};

}  // namespace

double separate(const Model& model, const Parameters& parameters, const Options& options, State& state) {
  const VectorX drawn = state.q;
  Separation separation(model, parameters, options, state);
  return separation.run(state) ? StepNorms(model).displacement(state.q - drawn) : 0.0;
}

}  // namespace withe
