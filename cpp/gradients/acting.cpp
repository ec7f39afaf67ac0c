#include "gradients/acting.hpp"

namespace withe {

ActingNumbers::ActingNumbers(const Parameters& first) {
  stretches_.push_back({0, std::make_shared<const Parameters>(first), first.natural_version, {}, {}, {}, {}});
}

void ActingNumbers::record(std::size_t step, const Parameters& parameters) {
  const Stretch& last = stretches_.back();
  const MatrixX3& loads = last.loads.size() != 0 ? last.loads : last.base->loads;
  if (!divided_ && parameters.version == last.base->version && parameters.natural_version == last.natural_version &&
      parameters.loads == loads)
    return;
  divided_ = false;
  Stretch next{step, last.base, parameters.natural_version, {}, {}, {}, {}};
  if (parameters.version != last.base->version) {
    next.base = std::make_shared<const Parameters>(parameters);
  } else {
    if (parameters.natural_version != next.base->natural_version) {
      next.natural_curvature = parameters.natural_curvature;
      next.natural_twist = parameters.natural_twist;
      next.natural_stretch = parameters.edge_natural_stretch;
    }
    if (parameters.loads != next.base->loads) next.loads = parameters.loads;
  }
  stretches_.push_back(std::move(next));
}

void ActingNumbers::cut(std::size_t step) {
  while (stretches_.size() > 1 && stretches_.back().first >= step) {
    stretches_.pop_back();
    divided_ = true;  // a repeated note belongs to no earlier stretch
  }
}

const Parameters& ActingNumbers::play(const Model& model, std::size_t stretch, Player& out) const {
  const Stretch& wanted = stretches_[stretch];
  if (out.base && out.stretch == stretch) return out.now;
  const bool own_shape = !wanted.natural_curvature.empty();
  if (out.base != wanted.base || (!own_shape && out.now.natural_version != wanted.natural_version))
    out.now = *wanted.base;
  if (own_shape) {
    out.now.natural_curvature = wanted.natural_curvature;
    out.now.natural_twist = wanted.natural_twist;
    out.now.edge_natural_stretch = wanted.natural_stretch;
    update_natural(model, out.now);
  }
  out.now.loads = wanted.loads.size() != 0 ? wanted.loads : wanted.base->loads;
  out.base = wanted.base;
  out.stretch = stretch;
  return out.now;
}

}  // namespace withe
