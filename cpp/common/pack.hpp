#pragma once
/// A handful of doubles that are computed with together, on the compiler's vector extensions.
///
/// Only translation units that are compiled for one instruction set may include this header. Such a file first defines
/// WITHE_INSTRUCTION_SET (a namespace) and WITHE_LANES. It calls no inline function of another header except templates
/// on Pack. The linker keeps one copy of every other inline function, which the present machine may not be able to run.

#include <cstddef>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace withe::WITHE_INSTRUCTION_SET {

constexpr int kLanes = WITHE_LANES;

/// kLanes doubles.
struct Pack {
  using Native = double __attribute__((vector_size(8 * WITHE_LANES)));
  using Integers = long long __attribute__((vector_size(8 * WITHE_LANES)));
  Native v;

  Pack() = default;
  Pack(double s) : v(s - Native{}) {}  // implicit, so that formulas read as they do on doubles
  explicit Pack(Native n) : v(n) {}
  double operator[](int lane) const { return v[lane]; }
  Pack& operator+=(Pack b) { return v += b.v, *this; }
  Pack& operator-=(Pack b) { return v -= b.v, *this; }
  Pack& operator*=(Pack b) { return v *= b.v, *this; }
  friend Pack operator+(Pack a, Pack b) { return Pack(a.v + b.v); }
  friend Pack operator-(Pack a, Pack b) { return Pack(a.v - b.v); }
  friend Pack operator*(Pack a, Pack b) { return Pack(a.v * b.v); }
  friend Pack operator/(Pack a, Pack b) { return Pack(a.v / b.v); }
  friend Pack operator-(Pack a) { return Pack(-a.v); }
};

/// Packs in memory: anywhere, not only at multiples of their size.
using Unaligned = double __attribute__((vector_size(8 * WITHE_LANES), aligned(8), may_alias));

inline Pack load(const double* p) { return Pack(static_cast<Pack::Native>(*reinterpret_cast<const Unaligned*>(p))); }
inline void store(double* p, Pack a) { *reinterpret_cast<Unaligned*>(p) = a.v; }
/// From one number a lane. Written out, because numbers that are put in one by one go through memory.
template <class Number>
inline Pack from_lanes(const Number& number) {
#if WITHE_LANES == 4
  return Pack(Pack::Native{number(0), number(1), number(2), number(3)});
#else
  static_assert(kLanes == 2);
  return Pack(Pack::Native{number(0), number(1)});
#endif
}
/// p[index[0]], p[index[1]], ...
inline Pack gather(const double* p, const int* index) {
  return from_lanes([&](int l) { return p[index[l]]; });
}
/// p[stride index[0] + offset], ...: one number of a table with `stride` numbers a row.
inline Pack gather(const double* p, const int* index, int stride, int offset) {
  return from_lanes([&](int l) { return p[static_cast<std::ptrdiff_t>(stride) * index[l] + offset]; });
}

inline Pack square_root(Pack a) {
#if WITHE_LANES == 4 && defined(__AVX__)
  return Pack(static_cast<Pack::Native>(_mm256_sqrt_pd(a.v)));
#elif WITHE_LANES == 2 && defined(__SSE2__)
  return Pack(static_cast<Pack::Native>(_mm_sqrt_pd(a.v)));
#else
  for (int l = 0; l < kLanes; ++l) a.v[l] = __builtin_sqrt(a.v[l]);
  return a;
#endif
}
inline Pack absolute(Pack a) {
  return Pack(reinterpret_cast<Pack::Native>(reinterpret_cast<Pack::Integers>(a.v) & 0x7fffffffffffffffLL));
}
/// |a| with the sign of b.
inline Pack with_sign_of(Pack a, Pack b) {
  constexpr long long kSign = static_cast<long long>(0x8000000000000000ULL);
  return Pack(reinterpret_cast<Pack::Native>((reinterpret_cast<Pack::Integers>(a.v) & ~kSign) |
                                             (reinterpret_cast<Pack::Integers>(b.v) & kSign)));
}
/// True if the mask is set in every lane.
inline bool all(Pack::Integers mask) {
  long long set = -1;
  for (int l = 0; l < kLanes; ++l) set &= mask[l];
  return set != 0;
}
/// `yes` where the mask is set, else `no`.
inline Pack select(Pack::Integers mask, Pack yes, Pack no) { return Pack(mask ? yes.v : no.v); }
inline Pack smaller(Pack a, Pack b) { return select(a.v < b.v, a, b); }
inline Pack larger(Pack a, Pack b) { return select(a.v > b.v, a, b); }
/// Nearest integer; |a| below 2^51.
inline Pack round_to_integer(Pack a) {
  const Pack magic = 6755399441055744.0;  // 1.5 * 2^52: the sum has no fraction left
  return (a + magic) - magic;
}
inline double sum(Pack a) {
  double s = a.v[0];
  for (int l = 1; l < kLanes; ++l) s += a.v[l];
  return s;
}

/// Transposes kLanes packs: lane j of the i-th becomes lane i of the j-th. From one place to another, because a loop
/// that copies packs becomes a memcpy, which moves them by halves.
inline void transpose(const Pack* in, Pack* out) {
#if WITHE_LANES == 4
  const Pack::Native a = in[0].v, b = in[1].v, c = in[2].v, d = in[3].v;
  const Pack::Native ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Pack::Native cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  out[0].v = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5);
  out[1].v = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5);
  out[2].v = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
  out[3].v = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
#else
  const Pack::Native a = in[0].v, b = in[1].v;
  out[0].v = __builtin_shufflevector(a, b, 0, 2);
  out[1].v = __builtin_shufflevector(a, b, 1, 3);
#endif
}

/// Reads `count` numbers from each of kLanes places into packs, one pack a number. `count` is a multiple of kLanes.
template <int count>
inline void load_rows(const double* const* place, Pack* out) {
  static_assert(count % kLanes == 0);
  for (int k = 0; k < count; k += kLanes) {
    Pack block[kLanes];
    for (int l = 0; l < kLanes; ++l) block[l] = load(place[l] + k);
    transpose(block, out + k);
  }
}

/// `count` <= kLanes rows of three numbers that follow one another, the last one repeated.
inline void load_threes(const double* p, int count, Pack (&out)[3]) {
#if WITHE_LANES == 4
  if (count == kLanes) {
    const Pack::Native a = load(p).v, b = load(p + 4).v, c = load(p + 8).v;
    out[0].v = __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5);
    out[1].v = __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6);
    out[2].v = __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 5, 5), c, 0, 1, 4, 7);
    return;
  }
#endif
  for (int i = 0; i < 3; ++i) out[i] = from_lanes([&](int l) { return p[3 * (l < count ? l : count - 1) + i]; });
}
inline void store_threes(double* p, int count, const Pack (&in)[3]) {
#if WITHE_LANES == 4
  if (count == kLanes) {
    const Pack::Native x = in[0].v, y = in[1].v, z = in[2].v;
    store(p, Pack(__builtin_shufflevector(__builtin_shufflevector(x, y, 0, 4, 1, 1), z, 0, 1, 4, 2)));
    store(p + 4, Pack(__builtin_shufflevector(__builtin_shufflevector(y, z, 1, 5, 2, 2), x, 0, 1, 6, 2)));
    store(p + 8, Pack(__builtin_shufflevector(z, __builtin_shufflevector(x, y, 3, 3, 7, 7), 2, 4, 6, 3)));
    return;
  }
#endif
  for (int l = 0; l < count; ++l)
    for (int i = 0; i < 3; ++i) p[3 * l + i] = in[i][l];
}

/// Highest power first.
template <int count>
inline Pack polynomial(const double (&coefficient)[count], Pack u) {
  Pack p = coefficient[0];
  for (int i = 1; i < count; ++i) p = p * u + Pack(coefficient[i]);
  return p;
}

struct SineCosine {
  Pack sine, cosine;
};

/// Both to about an ulp; polynomials by minimax fit over [-pi/4, pi/4].
inline SineCosine sine_cosine(Pack angle) {
  if (!all(absolute(angle).v < Pack(1e6).v))  // outside the range of the reduction below
    return {from_lanes([&](int l) { return __builtin_sin(angle[l]); }),
            from_lanes([&](int l) { return __builtin_cos(angle[l]); })};
  const Pack n = round_to_integer(angle * Pack(0.63661977236758134308));
  // pi / 2 in three parts whose first two have room for n.
  const Pack r = ((angle - n * Pack(0x1.921fb544p+0)) - n * Pack(0x1.0b4611a6p-34)) - n * Pack(0x1.3198a2e037073p-69);
  const Pack u = r * r;
  constexpr double kSine[] = {-7.578090160922686e-13, 1.6058352428871255e-10,  -2.5052104779095043e-08,
                              2.7557319213562225e-06, -0.00019841269841253478, 0.008333333333333321,
                              -0.16666666666666666};
  constexpr double kCosine[] = {4.7458719020432915e-14,  -1.1470460887609959e-11, 2.087675579108042e-09,
                                -2.7557319221402824e-07, 2.4801587301584645e-05,  -0.0013888888888888887,
                                0.041666666666666664};
  const Pack s = r + r * (u * polynomial(kSine, u));
  const Pack c = (Pack(1.0) - Pack(0.5) * u) + (u * u) * polynomial(kCosine, u);
  // n modulo 4 from its two lowest bits. The sum with 1.5 * 2^52 moves these bits to the end.
  const auto bits = reinterpret_cast<Pack::Integers>((n + Pack(6755399441055744.0)).v);
  const Pack::Integers odd = (bits & 1) != 0, half_turn = (bits & 2) != 0, other = ((bits + 1) & 2) != 0;
  SineCosine out{select(odd, c, s), select(odd, s, c)};
  out.sine = select(half_turn, -out.sine, out.sine);
  out.cosine = select(other, -out.cosine, out.cosine);
  return out;
}

/// Angle of (x, y) in (-pi, pi] to about an ulp of pi; polynomial by minimax fit over [-tan(pi/8), tan(pi/8)].
inline Pack arctangent(Pack y, Pack x) {
  const Pack ax = absolute(x), ay = absolute(y);
  const Pack low = smaller(ax, ay), high = larger(ax, ay);
  const Pack::Integers upper = low.v > (Pack(0.41421356237309504880) * high).v;
  // atan a = pi/4 + atan((a - 1) / (a + 1))
  const Pack t = select(upper, low - high, low) / select(upper, low + high, high);
  const Pack u = t * t;
  constexpr double kArctangent[] = {0.015113765096600925, -0.03338782450121195, 0.04499500728984032,
                                    -0.05217312574061591, 0.05876834004614161,  -0.06666205259976526,
                                    0.07692281099937744,  -0.09090908059031191, 0.11111111085322109,
                                    -0.1428571428532971,  0.19999999999997015,  -0.33333333333333326};
  Pack angle = t + t * (u * polynomial(kArctangent, u));
  angle = select(upper, angle + Pack(0.78539816339744830962), angle);
  angle = select(ay.v > ax.v, Pack(1.57079632679489661923) - angle, angle);
  angle = select(x.v < Pack(0.0).v, Pack(3.14159265358979323846) - angle, angle);
  return with_sign_of(angle, y);
}

/// atanh(u) for 0 <= u < 1. Let (1 + u) / (1 - u) = 2^k m with m within a factor sqrt(2) of 1, and t = (m - 1) / (m +
/// 1). Then atanh(u) = k ln(2) / 2 + atanh(t). The error is one ulp of the result, plus the effect of rounding 1 - u.
inline Pack inverse_tanh(Pack u) {
  using Unsigned = unsigned long long __attribute__((vector_size(8 * WITHE_LANES)));
  const Pack up = Pack(1.0) + u, down = Pack(1.0) - u;
  const auto bits = reinterpret_cast<Unsigned>((up / down * Pack(1.41421356237309504880)).v) & 0x7ff0000000000000ULL;
  // 2^52 and an integer below that, put together by their bits; an exponent is stored with 1023 added.
  const Pack k = Pack(reinterpret_cast<Pack::Native>((bits >> 52) | 0x4330000000000000ULL)) - Pack(4503599627371519.0);
  const Pack scaled = Pack(reinterpret_cast<Pack::Native>(bits)) * down;
  const Pack t = select(k.v < Pack(0.5).v, u, (up - scaled) / (up + scaled)), t2 = t * t;
  constexpr double kSeries[] = {1.0 / 21.0, 1.0 / 19.0, 1.0 / 17.0, 1.0 / 15.0, 1.0 / 13.0,
                                1.0 / 11.0, 1.0 / 9.0,  1.0 / 7.0,  1.0 / 5.0,  1.0 / 3.0};
  return k * Pack(0.34657359027997265471) + (t + t * (t2 * polynomial(kSeries, t2)));
}

}  // namespace withe::WITHE_INSTRUCTION_SET
