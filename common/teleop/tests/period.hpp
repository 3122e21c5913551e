#pragma once

namespace phantom::teleop {

inline constexpr double kDt = 0.001;  // s, of the servo that the tests stand in for

}  // namespace phantom::teleop
