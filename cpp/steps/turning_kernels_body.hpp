// The kernels of turning_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "geometry/frame_packs.hpp"
#include "steps/turning_inertia.hpp"
#include "steps/turning_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {

// Found by its argument's namespace, so in no other.
inline Pack finite_turn(Pack angle) {
  const SineCosine half = sine_cosine(0.5 * angle);
  return 2.0 * half.sine / half.cosine;
}

namespace {

enum class Turning { euler, midpoint, energy_momentum };

template <Turning rule>
[[gnu::flatten]] void turning(const TurningBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int e[kLanes], tail[kLanes], head[kLanes], angle[kLanes];
    const int live = lanes_from(first, batch.count, e);
    for (int l = 0; l < kLanes; ++l)
      tail[l] = batch.tail[e[l]], head[l] = batch.head[e[l]], angle[l] = batch.angle[e[l]];
    const auto vector = [&](const double* q) { return three_unknowns(q, head) - three_unknowns(q, tail); };
    const EdgeFrame<Pack> frame = frames_of(batch.frames, e);
    TurningEdge<Pack> edge{};
    edge.tangent = frame.tangent;
    edge.spin = frame.spin;
    edge.inverse_length = frame.inverse_length;
    edge.start_tangent = rows_from(batch.start_tangent, first, live);
    edge.change = gather(batch.z, angle) - gather(batch.start_q, angle);
    edge.start_rate = gather(batch.start_v, angle);
    if constexpr (rule == Turning::energy_momentum) {
      edge.end_tangent = frames_of(batch.end_frames, e).tangent;
      edge.start_length = gather(batch.start_length, e);
      edge.end_length = gather(batch.end_length, e);
    } else if constexpr (rule == Turning::midpoint) {
      const Vec3<Pack> e1 = 2.0 * vector(batch.z) - vector(batch.start_q);
      edge.end_tangent = (1.0 / square_root(dot(e1, e1))) * e1;
    }
    const Pack inertia = gather(batch.inertia, e);
    TurningForce<Pack> out;
    if constexpr (rule == Turning::euler)
      out = euler_turning(inertia, batch.interval, edge, vector(batch.z) - vector(batch.start_q));
    else
      out = midpoint_turning(inertia, 2.0 * batch.interval, rule == Turning::energy_momentum, edge);
    store_rows(batch.force, first, live, out.head);
    store_first(batch.torque + first, out.torque, live);
  }
}

[[gnu::flatten]] void finite_turns(int count, const int* angle, const double* change, double* turn) {
  for (int first = 0; first < count; first += kLanes) {
    int i[kLanes], place[kLanes];
    const int live = lanes_from(first, count, i);
    for (int l = 0; l < kLanes; ++l) place[l] = angle[i[l]];
    store_first(turn + first, finite_turn(gather(change, place)), live);
  }
}

}  // namespace

extern const TurningKernels kTurningKernels;
const TurningKernels kTurningKernels{turning<Turning::euler>, turning<Turning::midpoint>,
                                     turning<Turning::energy_momentum>, finite_turns};

}  // namespace withe::WITHE_INSTRUCTION_SET
