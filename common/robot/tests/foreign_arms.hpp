#pragma once
// Arms that are not ours, as URDF text: their published dimensions, bare of everything but kinematics.

#include <string>
#include <vector>

namespace phantom::robot::foreign_arms {

struct Foreign {
  std::string name, tip, body;
};

inline std::string joint(int i, const std::string& type, const std::string& xyz, const std::string& rpy,
                         const std::string& axis, const std::string& limit = R"(lower="-2.8" upper="2.8")") {
  const std::string n = std::to_string(i);
  return "<link name=\"l" + n + "\"/><joint name=\"j" + n + "\" type=\"" + type + "\"><parent link=\"l" +
         std::to_string(i - 1) + "\"/><child link=\"l" + n + "\"/><origin xyz=\"" + xyz + "\" rpy=\"" + rpy +
         "\"/><axis xyz=\"" + axis + "\"/><limit " + limit + R"( velocity="2" effort="80"/></joint>)";
}

inline std::string tool(int last, const std::string& xyz, const std::string& rpy) {
  return R"(<link name="tip"/><joint name="mount" type="fixed"><parent link="l)" + std::to_string(last) +
         R"("/><child link="tip"/><origin xyz=")" + xyz + "\" rpy=\"" + rpy + R"("/></joint>)";
}

inline std::vector<Foreign> all() {
  const std::string base = R"(<link name="l0"/>)";
  return {
      // Six revolute joints with parallel shoulder, elbow and wrist axes (the UR5's dimensions).
      {"six_revolute", "tip",
       base + joint(1, "revolute", "0 0 0.089159", "0 0 0", "0 0 1") +
           joint(2, "revolute", "0 0.13585 0", "0 1.570796325 0", "0 1 0") +
           joint(3, "revolute", "0 -0.1197 0.425", "0 0 0", "0 1 0") +
           joint(4, "revolute", "0 0 0.39225", "0 1.570796325 0", "0 1 0") +
           joint(5, "revolute", "0 0.093 0", "0 0 0", "0 0 1") +
           joint(6, "revolute", "0 0 0.09465", "0 0 0", "0 1 0") + tool(6, "0 0.0823 0", "0 0 1.570796325")},
      // Seven revolute joints, every frame turned by a quarter (the Panda's dimensions).
      {"seven_revolute", "tip",
       base + joint(1, "revolute", "0 0 0.333", "0 0 0", "0 0 1") +
           joint(2, "revolute", "0 0 0", "-1.57079632679 0 0", "0 0 1", R"(lower="-1.76" upper="1.76")") +
           joint(3, "revolute", "0 -0.316 0", "1.57079632679 0 0", "0 0 1") +
           joint(4, "revolute", "0.0825 0 0", "1.57079632679 0 0", "0 0 1",
                 R"(lower="-3.07" upper="-0.07")") +
           joint(5, "revolute", "-0.0825 0.384 0", "-1.57079632679 0 0", "0 0 1") +
           joint(6, "revolute", "0 0 0", "1.57079632679 0 0", "0 0 1", R"(lower="-0.01" upper="3.75")") +
           joint(7, "revolute", "0.088 0 0", "1.57079632679 0 0", "0 0 1") +
           tool(7, "0 0 0.107", "0 0 -0.785398163397")},
      // A SCARA: two parallel revolute joints, a prismatic quill that points down, a continuous flange.
      {"scara", "tip",
       base + joint(1, "revolute", "0 0 0.342", "0 0 0", "0 0 1") +
           joint(2, "revolute", "0.325 0 0", "0 0 0", "0 0 1") +
           joint(3, "prismatic", "0.275 0 0", "3.14159265359 0 0", "0 0 1", R"(lower="0" upper="0.21")") +
           joint(4, "continuous", "0 0 0.05", "0 0 0", "0 0 -1") + tool(4, "0.02 0 0.06", "0.1 0.2 0.3")},
      // A gantry of three prismatic joints with a slanted wrist.
      {"gantry", "tip",
       base + joint(1, "prismatic", "0.1 0.2 2.1", "0 0 0.3", "1 0 0", R"(lower="-0.9" upper="0.9")") +
           joint(2, "prismatic", "0 0 -0.1", "0 0 0", "0 1 0", R"(lower="-0.6" upper="0.6")") +
           joint(3, "prismatic", "0 0.05 0", "0.05 0 0", "0 0 -1", R"(lower="0" upper="1.1")") +
           joint(4, "revolute", "0 0 -0.4", "0 0 0", "0.6 0 0.8") + tool(4, "0 0 -0.2", "0 0 0")},
  };
}

}  // namespace phantom::robot::foreign_arms
