#pragma once
// Reads the messages of the scene stream by the words of README.md alone, apart from the code that makes
// them.

#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace phantom::synthetic_viewer::test {

/// A scene as a browser knows it.
class DecodedScene {
 public:
  struct Mark {
    int shape = 0, views = 0;
    double own_light = 0.0;
    Eigen::Affine3d X_WS = Eigen::Affine3d::Identity();
    std::vector<double> colour;  // red, green, blue, opacity
  };
  struct Patch {
    int link = 0;
    double closeness = 0.0;
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  };

  void take_text(const std::string& text) {
    const nlohmann::json json = nlohmann::json::parse(text);
    const auto type = json.at("type").get<std::string>();
    if (type == "cell") cell = json;
    if (type == "view") view = json;
    if (type == "echo") echo = json;
    if (type == "state") take_state(json);
    if (type == "hand") hand = json.at("state").get<std::string>();
    if (type != "item") return;
    const auto id = json.at("id").get<std::string>();
    if (json.contains("gone")) items.erase(id);
    if (!json.contains("gone")) items[id] = json;
  }

  void take_binary(const std::string& octets) {
    at_ = octets.data();
    end_ = at_ + octets.size();
    const int kind = get<std::uint8_t>();
    if (kind == 1) return take_poses();
    if (kind == 2) return take_paint();
    if (kind == 3) return take_alive();
    throw std::runtime_error("unknown kind");
  }

  static Eigen::Affine3d matrix_of_json(const nlohmann::json& numbers) {
    Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
    for (int i = 0; i < 12; ++i) matrix.matrix()(i / 4, i % 4) = numbers.at(static_cast<std::size_t>(i));
    return matrix;
  }
  /// Where an item's mesh is, in W.
  Eigen::Affine3d X_WM(const nlohmann::json& item) const {
    const int body = item.at("body");
    const Eigen::Affine3d X_BM = matrix_of_json(item.at("matrix"));
    return body < 0 ? X_BM : bodies.at(static_cast<std::size_t>(body)) * X_BM;
  }

  nlohmann::json cell, view, echo;
  nlohmann::json state;                 ///< the page's numbers and alerts
  std::vector<std::string> told_state;  ///< the messages that made it
  std::string hand;                     // how it is with the hand; empty: nothing was said of it
  std::map<std::string, nlohmann::json> items;
  std::vector<Eigen::Affine3d> bodies;
  std::vector<Mark> marks;
  std::vector<Patch> patches;
  int flags = 0, poses_count = 0, paint_count = 0, alive_count = 0;
  std::uint32_t number = 0;
  double time_s = 0.0, arm_age_s = 0.0, percept_age_s = 0.0, tool_free = 0.0, closeness = 0.0,
         speed_m_s = 0.0, patch_m = 0.0;

 private:
  template <class T>
  T get() {
    T value{};
    if (end_ - at_ < static_cast<std::ptrdiff_t>(sizeof value)) throw std::runtime_error("too short");
    std::memcpy(&value, at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  Eigen::Vector3d vector() {
    const float x = get<float>(), y = get<float>(), z = get<float>();
    return {x, y, z};
  }
  Eigen::Quaterniond quaternion() {
    const double x = get<std::int16_t>(), y = get<std::int16_t>(), z = get<std::int16_t>(),
                 w = get<std::int16_t>();
    return Eigen::Quaterniond(w, x, y, z).normalized();
  }
  void end() const {
    if (at_ != end_) throw std::runtime_error("too long");
  }

  void take_state(const nlohmann::json& message) {
    told_state.push_back(message.dump());
    for (const auto& [key, value] : message.items()) {
      if (key == "type") continue;
      if (value.is_object() && !value.empty() && state[key].is_object())
        state[key].update(value);
      else
        state[key] = value;
    }
  }

  void take_alive() {
    for (int i = 0; i < 7; ++i) get<std::uint8_t>();
    time_s = get<double>();
    end();
    ++alive_count;
  }

  void take_poses() {
    flags = get<std::uint8_t>();
    const int body_count = get<std::uint8_t>(), mark_count = get<std::uint8_t>();
    number = get<std::uint32_t>();
    time_s = get<double>();
    arm_age_s = get<float>();
    percept_age_s = get<float>();
    tool_free = get<float>();
    closeness = get<float>();
    speed_m_s = get<float>();
    bodies.clear();
    marks.clear();
    for (int i = 0; i < body_count; ++i) {
      const Eigen::Translation3d origin(vector());
      bodies.emplace_back(origin * quaternion());
    }
    for (int i = 0; i < mark_count; ++i) {
      Mark mark;
      mark.shape = get<std::uint8_t>();
      mark.views = get<std::uint8_t>();
      mark.own_light = get<std::uint8_t>() / 255.0;
      get<std::uint8_t>();
      const Eigen::Translation3d origin(vector());
      const Eigen::Quaterniond rotation = quaternion();
      mark.X_WS = origin * rotation * Eigen::Scaling(vector());
      for (int c = 0; c < 4; ++c) mark.colour.push_back(get<std::uint16_t>() / 65535.0);
      marks.push_back(std::move(mark));
    }
    end();
    ++poses_count;
  }

  void take_paint() {
    get<std::uint8_t>();
    const int count = get<std::uint16_t>();
    get<std::uint32_t>();
    patch_m = get<float>();
    const double unit_m = get<float>();
    patches.clear();
    for (int i = 0; i < count; ++i) {
      Patch patch;
      patch.link = get<std::uint8_t>();
      patch.closeness = get<std::uint8_t>() / 255.0;
      for (int axis = 0; axis < 3; ++axis) patch.middle_m[axis] = unit_m * get<std::int16_t>();
      patches.push_back(patch);
    }
    end();
    ++paint_count;
  }

  const char* at_ = nullptr;
  const char* end_ = nullptr;
};

}  // namespace phantom::synthetic_viewer::test
