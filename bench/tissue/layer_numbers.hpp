// Numbers of bench/calculix/layer.csv, computed by bench/calculix/layer.py; a test compares both.
#pragma once

namespace palpate {

/// For thickness 1, G / (1 - nu) = 1 and a punch that moves by 1, or a ball of radius 1.
struct LayerNumbers {
  bool is_ball;
  double a_over_h, poisson;
  double depth, force;
};

inline constexpr LayerNumbers kLayerNumbers[] = {
    {false, 1, 0.3, 1, 9.934099},
    {false, 1, 0.45, 1, 12.36563},
    {false, 1, 0.49, 1, 13.93593},
    {true, 1, 0.3, 0.6476223, 3.357249},
    {true, 1, 0.45, 0.5947224, 3.603523},
    {true, 1, 0.49, 0.567674, 3.724485},
    {true, 0.1, 0.3, 0.009421665, 0.002668069},
    {true, 0.1, 0.45, 0.009318077, 0.002668535},
};

}  // namespace palpate
