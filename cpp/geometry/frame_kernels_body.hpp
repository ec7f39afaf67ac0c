// The kernels of frame_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "geometry/curvature.hpp"
#include "geometry/frame_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// The kLanes indices from `first`, the last one repeated; returns how many are real.
int lanes_from(int first, int count, int (&index)[kLanes]) {
  for (int l = 0; l < kLanes; ++l) index[l] = first + l < count ? first + l : count - 1;
  return count - first < kLanes ? count - first : kLanes;
}

void store_first(double* place, Pack a, int count) {
  if (count == kLanes) return store(place, a);
  for (int l = 0; l < count; ++l) place[l] = a[l];
}

Vec3<Pack> gather_rows(const double* table, const int (&row)[kLanes]) {
  return {gather(table, row, 3, 0), gather(table, row, 3, 1), gather(table, row, 3, 2)};
}

[[gnu::flatten]] void edges(const EdgeBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int e[kLanes], tail[kLanes], head[kLanes], angle[kLanes];
    const int live = lanes_from(first, batch.count, e);
    for (int l = 0; l < kLanes; ++l)
      tail[l] = batch.tail[e[l]], head[l] = batch.head[e[l]], angle[l] = batch.angle[e[l]];
    const double* q = batch.q;
    const Vec3<Pack> d{gather(q, head) - gather(q, tail), gather(q + 1, head) - gather(q + 1, tail),
                       gather(q + 2, head) - gather(q + 2, tail)};
    const Pack length = square_root(dot(d, d));
    const SineCosine turn = sine_cosine(gather(q, angle));
    const EdgeFrame<Pack> frame =
        edge_frame(d, length, gather_rows(batch.source, e), gather_rows(batch.reference, e), turn.cosine, turn.sine);
    const Vec3<Pack>* part[5] = {&frame.tangent, &frame.d1, &frame.d2, &frame.spin, &frame.bow};
    Pack number[kFrameNumbers];
    for (int i = 0; i < 5; ++i) {
      const int k = 3 * i + (i > 2);
      number[k] = part[i]->x, number[k + 1] = part[i]->y, number[k + 2] = part[i]->z;
    }
    number[kInverseLength] = frame.inverse_length;
    for (int k = 0; k < kFrameNumbers; k += kLanes) {
      Pack block[kLanes];
      transpose(number + k, block);
      for (int l = 0; l < live; ++l) store(batch.frames + std::ptrdiff_t{kFrameNumbers} * e[l] + k, block[l]);
    }
    store_first(batch.length + first, length, live);
  }
}

[[gnu::flatten]] void planar_edges(const EdgeBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int e[kLanes], tail[kLanes], head[kLanes];
    const int live = lanes_from(first, batch.count, e);
    for (int l = 0; l < kLanes; ++l) tail[l] = batch.tail[e[l]], head[l] = batch.head[e[l]];
    const double* q = batch.q;
    const Pack x = gather(q, head) - gather(q, tail), y = gather(q + 1, head) - gather(q + 1, tail);
    const Pack length = square_root(x * x + y * y);
    const Pack inverse = 1.0 / length, tx = inverse * x, ty = inverse * y;
    for (int l = 0; l < live; ++l) {
      double* frame = batch.frames + std::ptrdiff_t{kFrameNumbers} * e[l];
      frame[0] = tx[l];
      frame[1] = ty[l];
      frame[kInverseLength] = inverse[l];
    }
    store_first(batch.length + first, length, live);
  }
}

/// The frames of kLanes edges.
EdgeFrame<Pack> frames_of(const double* frames, const int (&edge)[kLanes]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l) place[l] = frames + std::ptrdiff_t{kFrameNumbers} * edge[l];
  Pack number[kFrameNumbers];
  load_rows<kFrameNumbers>(place, number);
  return {{number[0], number[1], number[2]},    {number[3], number[4], number[5]},
          {number[6], number[7], number[8]},    number[9],
          {number[10], number[11], number[12]}, {number[13], number[14], number[15]}};
}

[[gnu::flatten]] void strains(const StrainBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int s[kLanes], a[kLanes], b[kLanes];
    const int live = lanes_from(first, batch.count, s);
    for (int l = 0; l < kLanes; ++l) {
      const int* pair = batch.edges + static_cast<std::ptrdiff_t>(batch.edge_stride) * s[l];
      a[l] = pair[0], b[l] = pair[1];
    }
    const BendTwistStrain<Pack> strain =
        bend_twist_strain(frames_of(batch.frames, a), frames_of(batch.frames, b), gather(batch.previous_tau, s));
    store_first(batch.strain + first, strain.kappa1, live);
    store_first(batch.strain + batch.column + first, strain.kappa2, live);
    store_first(batch.strain + 2 * batch.column + first, strain.tau, live);
  }
}

[[gnu::flatten]] void planar_strains(const StrainBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int s[kLanes], a[kLanes], b[kLanes];
    const int live = lanes_from(first, batch.count, s);
    for (int l = 0; l < kLanes; ++l) {
      const int* pair = batch.edges + static_cast<std::ptrdiff_t>(batch.edge_stride) * s[l];
      a[l] = pair[0], b[l] = pair[1];
    }
    const double* f = batch.frames;
    const Pack kappa = planar_kappa(gather(f, a, kFrameNumbers, 0), gather(f, a, kFrameNumbers, 1),
                                    gather(f, b, kFrameNumbers, 0), gather(f, b, kFrameNumbers, 1));
    store_first(batch.strain + first, kappa, live);
  }
}

[[gnu::flatten]] void carry(const CarryBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int e[kLanes];
    const int live = lanes_from(first, batch.count, e);
    const double* f = batch.frames;
    const Vec3<Pack> t{gather(f, e, kFrameNumbers, 0), gather(f, e, kFrameNumbers, 1), gather(f, e, kFrameNumbers, 2)};
    Vec3<Pack> d = parallel_transport(gather_rows(batch.reference, e), gather_rows(batch.source, e), t);
    d = d - dot(d, t) * t;
    d = (1.0 / square_root(dot(d, d))) * d;
    for (int l = 0; l < live; ++l) {
      double *source = batch.source + std::ptrdiff_t{3} * e[l], *reference = batch.reference + std::ptrdiff_t{3} * e[l];
      source[0] = t.x[l], source[1] = t.y[l], source[2] = t.z[l];
      reference[0] = d.x[l], reference[1] = d.y[l], reference[2] = d.z[l];
    }
  }
}

}  // namespace

extern const FrameKernels kFrameKernels;
const FrameKernels kFrameKernels{edges, strains, planar_edges, planar_strains, carry};

}  // namespace withe::WITHE_INSTRUCTION_SET
