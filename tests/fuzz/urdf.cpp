// Arms as URDF files, as graphs: links and joints that the input connects at will, with limits, mimics,
// masses and bodies of odd numbers. What is no tree is refused, by the name of a link or a joint; what is
// read is an arm whose every number can be used.

#include <fuzzer/FuzzedDataProvider.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"

namespace {

using namespace phantom;

void need(bool holds) {
  if (!holds) std::abort();
}

constexpr std::size_t kMaxLinks = 12, kMaxJoints = 16;

struct Edge {
  std::size_t parent = 0, child = 0;  // kMaxLinks and more: a link that the file lacks
};
struct Graph {
  std::size_t links = 1;
  std::vector<Edge> joints;
};

std::string link_name(std::size_t i) { return "link_" + std::to_string(i); }
std::string joint_name(std::size_t i) { return "joint_" + std::to_string(i); }

/// Whether the joints make one tree of the links. Literal: counts parents, then follows children from the
/// root.
bool is_tree(const Graph& graph) {
  std::vector<int> parents(graph.links);
  for (const Edge& edge : graph.joints) {
    if (edge.parent >= graph.links || edge.child >= graph.links) return false;
    ++parents[edge.child];
  }
  const auto root = std::find(parents.begin(), parents.end(), 0);
  if (root == parents.end() || std::any_of(parents.begin(), parents.end(), [](int n) { return n > 1; }))
    return false;
  std::vector<std::size_t> reached{static_cast<std::size_t>(root - parents.begin())};
  for (std::size_t i = 0; i < reached.size() && reached.size() <= graph.links; ++i) {
    for (const Edge& edge : graph.joints)
      if (edge.parent == reached[i]) reached.push_back(edge.child);
  }
  return reached.size() == graph.links;
}

/// A number of a tenth from `least` to 4; now and then an odd one, or none.
std::string number(FuzzedDataProvider& data, double least = -4.0) {
  static constexpr std::array kOdd{"0", "-1", "1e-9", "1e9", "-1e308", "nan", "inf", "-inf", "1,5", "x", ""};
  const int tenths = data.ConsumeIntegralInRange(static_cast<int>(10 * least), 42);
  return tenths > 40 ? data.PickValueInArray(kOdd) : std::to_string(0.1 * tenths);
}
std::string attribute(const char* name, FuzzedDataProvider& data, double least = -4.0) {
  return std::string(" ") + name + "=\"" + number(data, least) + "\"";
}

std::string link_text(std::size_t i, FuzzedDataProvider& data) {
  std::string text = "<link name=\"" + link_name(i) + "\">";
  if (data.ConsumeBool()) {
    text += "<inertial><mass" + attribute("value", data, 0.0) + "/><inertia";
    for (const char* moment : {"ixx", "iyy", "izz"}) text += attribute(moment, data, 1.0);
    for (const char* product : {"ixy", "ixz", "iyz"})
      text += data.ConsumeBool() ? std::string(" ") + product + "=\"0\"" : attribute(product, data);
    text += "/></inertial>";
  }
  if (data.ConsumeBool())
    text += "<visual><geometry><cylinder" + attribute("radius", data, 0.0) + attribute("length", data, 0.0) +
            "/></geometry></visual>";
  return text + "</link>";
}

std::string joint_text(std::size_t i, const Edge& edge, std::size_t joints, FuzzedDataProvider& data) {
  static constexpr std::array kTypes{"revolute", "continuous", "prismatic", "fixed",
                                     "floating", "planar",     "hinge"};
  std::string text = "<joint name=\"" + joint_name(i) + "\" type=\"" + data.PickValueInArray(kTypes) +
                     "\"><parent link=\"" + link_name(edge.parent) + "\"/><child link=\"" +
                     link_name(edge.child) + "\"/>";
  if (data.ConsumeBool())
    text += "<axis xyz=\"" + number(data) + " " + number(data) + " " + number(data) + "\"/>";
  if (data.ConsumeBool())
    text += "<origin xyz=\"" + number(data) + " 0 0\" rpy=\"0 " + number(data) + " 0\"/>";
  if (data.ConsumeIntegralInRange(0, 3) > 0) {
    text += "<limit";
    text += attribute("lower", data) + attribute("upper", data) + attribute("velocity", data, 0.0) +
            attribute("effort", data, 0.0);
    text += "/>";
  }
  if (data.ConsumeIntegralInRange(0, 3) == 0)
    text += "<mimic joint=\"" + joint_name(data.ConsumeIntegralInRange<std::size_t>(0, joints)) + "\"" +
            attribute("multiplier", data) + attribute("offset", data) + "/>";
  return text + "</joint>";
}

/// A chain, of which some joints are connected otherwise.
Graph graph_of(FuzzedDataProvider& data) {
  Graph graph{data.ConsumeIntegralInRange<std::size_t>(1, kMaxLinks), {}};
  const auto any = [&] { return data.ConsumeIntegralInRange<std::size_t>(0, graph.links); };
  const std::size_t joints =
      data.ConsumeBool() ? graph.links - 1 : data.ConsumeIntegralInRange<std::size_t>(0, kMaxJoints);
  for (std::size_t i = 0; i < joints; ++i)
    graph.joints.push_back(data.ConsumeIntegralInRange(0, 7) > 0 ? Edge{i, i + 1} : Edge{any(), any()});
  return graph;
}

void check_arm(const robot::SerialArm& arm) {
  need(arm.joint_count() >= 1 && arm.joint_count() <= core::kMaxJoints &&
       arm.links().size() == arm.joint_count() + 1);
  for (const robot::Joint& joint : arm.joints()) {
    need(joint.lower < joint.upper && joint.max_speed > 0.0 && joint.max_effort > 0.0);
    need(std::isfinite(joint.max_speed) && std::isfinite(joint.max_effort) &&
         std::abs(joint.axis.norm() - 1.0) < 1e-9);
  }
  for (const robot::Link& link : arm.links()) need(link.mass_kg >= 0.0 && std::isfinite(link.mass_kg));
  robot::LinkPoses poses;
  arm.link_poses({}, poses);
  for (std::size_t i = 0; i <= arm.joint_count(); ++i)
    need(poses[i].rotation.allFinite() && poses[i].translation_m.allFinite());
}

/// A file in memory, by the path that a reader opens.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& text) : file_(memfd_create("arm.urdf", MFD_CLOEXEC)) {
    need(file_ >= 0 && write(file_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  const Graph graph = graph_of(data);
  std::string text = "<robot name=\"r\">";
  for (std::size_t i = 0; i < graph.links; ++i) text += link_text(i, data);
  for (std::size_t i = 0; i < graph.joints.size(); ++i)
    text += joint_text(i, graph.joints[i], graph.joints.size(), data);
  const MemoryFile file(text + "</robot>");
  const std::string tip = link_name(data.ConsumeIntegralInRange<std::size_t>(0, graph.links));
  const auto arm = robot::SerialArm::from_urdf(file.path(), tip, {});
  if (arm) {
    need(is_tree(graph));
    check_arm(*arm);
    return 0;
  }
  const std::string& why = arm.status().message();
  need(why.starts_with(file.path() + ": "));
  need(why.find("link_") != std::string::npos || why.find("joint_") != std::string::npos ||
       why.find("moving joints") != std::string::npos);
  return 0;
}
