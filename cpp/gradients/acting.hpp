#pragma once
/// Parameters that acted in the steps of a run, where they changed during the run.

#include <memory>
#include <vector>

#include "model/model.hpp"

namespace withe {

/// Stretches of steps with equal parameters. Natural shapes and loads may change every step, and each stretch stores
/// its own; the stretches share all other parameters.
class ActingNumbers {
 public:
  explicit ActingNumbers(const Parameters& first);

  /// Notes the parameters of a step, which must not be earlier than the last one.
  void record(std::size_t step, const Parameters& parameters);
  /// Begins a stretch with the next step, even if no parameter has changed.
  void divide() { divided_ = true; }
  /// Forgets steps from there on.
  void cut(std::size_t step);

  std::size_t count() const { return stretches_.size(); }
  /// The first step of a stretch. The first stretch has the parameters before any step, and may have no steps.
  std::size_t first(std::size_t stretch) const { return stretches_[stretch].first; }
  /// Parameters before any step.
  const Parameters& start() const { return *stretches_.front().base; }
  /// Version of the natural shapes that acted last.
  long natural_version() const { return stretches_.back().natural_version; }
  Eigen::Index load_rows() const { return start().loads.rows(); }
  /// Computes the parameters of a stretch in `out`, which may hold those of another stretch or be empty.
  struct Player {
    std::size_t stretch = 0;
    std::shared_ptr<const Parameters> base;
    Parameters now;
  };
  const Parameters& play(const Model& model, std::size_t stretch, Player& out) const;

 private:
  struct Stretch {
    std::size_t first = 0;
    std::shared_ptr<const Parameters> base;
    long natural_version = 0;
    std::vector<MatrixX2> natural_curvature;  ///< empty: that of the base stretch, also for the members below
    std::vector<VectorX> natural_twist;
    VectorX natural_stretch;
    MatrixX3 loads;
  };
  std::vector<Stretch> stretches_;
  bool divided_ = false;
};

}  // namespace withe
