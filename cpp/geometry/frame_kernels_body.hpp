// The kernels of frame_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "geometry/frame_packs.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

void store_frames(double* frames, int first, int live, const Pack (&number)[kFrameNumbers]) {
  for (int k = 0; k < kFrameNumbers; k += kLanes) {
    Pack block[kLanes];
    transpose(number + k, block);
    for (int l = 0; l < live; ++l) store(frames + std::ptrdiff_t{kFrameNumbers} * (first + l) + k, block[l]);
  }
}

/// A director carried along with its edge, normal to it and of unit length to rounding.
Vec3<Pack> carried(const Vec3<Pack>& reference, const Vec3<Pack>& source, const Vec3<Pack>& t) {
  Vec3<Pack> d = parallel_transport(reference, source, t);
  d = d - dot(d, t) * t;
  return (1.0 / square_root(dot(d, d))) * d;
}

[[gnu::flatten]] void edges(const EdgeBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int e[kLanes], tail[kLanes], head[kLanes], angle[kLanes];
    const int live = lanes_from(first, batch.count, e);
    for (int l = 0; l < kLanes; ++l)
      tail[l] = batch.tail[e[l]], head[l] = batch.head[e[l]], angle[l] = batch.angle[e[l]];
    const double* q = batch.q;
    const Vec3<Pack> d = three_unknowns(q, head) - three_unknowns(q, tail);
    const Pack length = square_root(dot(d, d));
    const SineCosine turn = sine_cosine(gather(q, angle));
    const EdgeFrame<Pack> frame = edge_frame(d, length, rows_from(batch.source, first, live),
                                             rows_from(batch.reference, first, live), turn.cosine, turn.sine);
    const Vec3<Pack>* part[5] = {&frame.tangent, &frame.d1, &frame.d2, &frame.spin, &frame.bow};
    Pack number[kFrameNumbers];
    for (int i = 0; i < 5; ++i) {
      const int k = 3 * i + (i > 2);
      number[k] = part[i]->x, number[k + 1] = part[i]->y, number[k + 2] = part[i]->z;
    }
    number[kInverseLength] = frame.inverse_length;
    store_frames(batch.frames, first, live, number);
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

[[gnu::flatten]] double advance(const AdvanceBatch& batch) {
  const EdgeBatch& edges = batch.edges;
  const double* q = edges.q;
  Pack smallest = 1.0;
  for (int first = 0; first < edges.count; first += kLanes) {
    int e[kLanes], tail[kLanes], head[kLanes], angle[kLanes];
    const int live = lanes_from(first, edges.count, e);
    for (int l = 0; l < kLanes; ++l)
      tail[l] = edges.tail[e[l]], head[l] = edges.head[e[l]], angle[l] = edges.angle[e[l]];
    const Vec3<Pack> d = three_unknowns(q, head) - three_unknowns(q, tail);
    const Pack length = square_root(dot(d, d)), inverse = 1.0 / length;
    const Vec3<Pack> t = inverse * d, source = rows_from(edges.source, first, live);
    smallest = smaller(dot(source, t), smallest);
    const Vec3<Pack> r1 = carried(rows_from(edges.reference, first, live), source, t), r2 = cross(t, r1);
    const SineCosine turn = sine_cosine(gather(q, angle));
    const Vec3<Pack> d1 = turn.cosine * r1 + turn.sine * r2, d2 = turn.cosine * r2 - turn.sine * r1;
    Pack number[kFrameNumbers] = {t.x, t.y, t.z, d1.x, d1.y, d1.z, d2.x, d2.y, d2.z, inverse};
    for (int k = kInverseLength + 1; k < kFrameNumbers; ++k) number[k] = 0.0;
    store_frames(edges.frames, first, live, number);
    store_rows(batch.next_source, first, live, t);
    store_rows(batch.next_reference, first, live, r1);
    store_first(edges.length + first, length, live);
  }
  double least = smallest[0];
  for (int l = 1; l < kLanes; ++l) least = smallest[l] < least ? smallest[l] : least;
  return least;
}

/// Numbers of kLanes stencils and of their two edges; returns how many of them there are.
int stencils_from(int first, const StrainBatch& batch, int (&s)[kLanes], int (&a)[kLanes], int (&b)[kLanes]) {
  const int live = lanes_from(first, batch.count, s);
  for (int l = 0; l < kLanes; ++l) {
    const int* pair = batch.edges + static_cast<std::ptrdiff_t>(batch.edge_stride) * s[l];
    a[l] = pair[0], b[l] = pair[1];
  }
  return live;
}

[[gnu::flatten]] void strains(const StrainBatch& batch) {
  for (int first = 0; first < batch.count; first += kLanes) {
    int s[kLanes], a[kLanes], b[kLanes];
    const int live = stencils_from(first, batch, s, a, b);
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
    const int live = stencils_from(first, batch, s, a, b);
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
    const Vec3<Pack> d = carried(rows_from(batch.reference, first, live), rows_from(batch.source, first, live), t);
    store_rows(batch.source, first, live, t);
    store_rows(batch.reference, first, live, d);
  }
}

}  // namespace

extern const FrameKernels kFrameKernels;
const FrameKernels kFrameKernels{edges, strains, planar_edges, planar_strains, carry, advance};

}  // namespace withe::WITHE_INSTRUCTION_SET
