#pragma once
/// One explicit Runge-Kutta step of order 8 with 12 stages [Dormand and Prince; Hairer, Norsett, Wanner 1993, II.5].
/// Numbers may carry derivatives. These are the derivatives of the discrete map, exact to rounding.

#include <array>

namespace withe {

namespace dormand_prince {
inline constexpr int kStages = 12;
// Row i holds the weights of the slopes that stage i starts from.
inline constexpr double kStage[kStages][kStages - 1] = {
    {},
    {0.05260015195876773},
    {0.0197250569845379, 0.0591751709536137},
    {0.02958758547680685, 0, 0.08876275643042054},
    {0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792},
    {0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242},
    {0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125},
    {0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402, 0.008273789163814023},
    {0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671, 20.154067550477894,
     -43.48988418106996},
    {0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193, 15.279233632882423,
     -33.28821096898486, -0.020331201708508627},
    {-0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927, -18.52006565999696,
     22.739487099350505, 2.4936055526796523, -3.0467644718982196},
    {2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188, 27.94888452941996,
     -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636}};
inline constexpr double kPlace[kStages] = {0,
                                           0.05260015195876773,
                                           0.0789002279381516,
                                           0.1183503419072274,
                                           0.2816496580927726,
                                           0.3333333333333333,
                                           0.25,
                                           0.3076923076923077,
                                           0.6512820512820513,
                                           0.6,
                                           0.8571428571428571,
                                           1.0};
inline constexpr double kSum[kStages] = {0.054293734116568765,
                                         0,
                                         0,
                                         0,
                                         0,
                                         4.450312892752409,
                                         1.8915178993145003,
                                         -5.801203960010585,
                                         0.3111643669578199,
                                         -0.1521609496625161,
                                         0.20136540080403034,
                                         0.04471061572777259};
}  // namespace dormand_prince

/// Advances y from s to s + h. `slope(s, y)` returns dy/ds, an array of as many numbers as y. Of these only the first
/// `coupled` may be looked at by `slope`; the others are integrals along the way.
template <int coupled, std::size_t count, class Scalar, class Place, class Slope>
void runge_kutta_step(const Slope& slope, const Place& s, const Place& h, std::array<Scalar, count>& y) {
  using namespace dormand_prince;
  std::array<Scalar, count> slopes[kStages];
  for (int stage = 0; stage < kStages; ++stage) {
    std::array<Scalar, count> at = y;
    for (std::size_t i = 0; i < coupled && stage > 0; ++i) {
      Scalar sum = kStage[stage][0] * slopes[0][i];
      for (int j = 1; j < stage; ++j)
        if (kStage[stage][j] != 0) sum += kStage[stage][j] * slopes[j][i];
      at[i] += h * sum;
    }
    slopes[stage] = slope(s + kPlace[stage] * h, at);
  }
  for (std::size_t i = 0; i < count; ++i) {
    Scalar sum = kSum[0] * slopes[0][i];
    for (int j = 5; j < kStages; ++j) sum += kSum[j] * slopes[j][i];  // the weights 1 to 4 are zero
    y[i] += h * sum;
  }
}

}  // namespace withe
