#include "common/observation/type_catalogue.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/diagnostics/decode.hpp"

namespace phantom::observation {
namespace {

template <class T>
nlohmann::ordered_json decoded(const dds::TopicSpec<T>& topic, const T& sample) {
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(dds::CdrCodec(topic).encode(&sample, bytes));
  const auto json = diagnostics::decode(*type_of(topic.type_name), bytes);
  EXPECT_TRUE(json) << json.status().message();
  return json ? *json : nlohmann::ordered_json();
}

TEST(TypeCatalogue, EveryTopicsTypeIsKnownAndDecodesAFreshSample) {
  for (const dds::TopicDescription* topic : dds::all_topics()) {
    const auto type = type_of(topic->type_name);
    ASSERT_TRUE(type) << topic->type_name;
    EXPECT_EQ(type->name, topic->type_name);
    const std::vector<std::uint8_t> zeros = [&] {  // little endian, all members 0 or empty
      std::vector<std::uint8_t> bytes{0, 1, 0, 0};
      bytes.resize(4 + 64 * 1024);
      return bytes;
    }();
    const auto json = diagnostics::decode(*type, zeros);
    ASSERT_FALSE(json) << "zeros far beyond the end";
    EXPECT_NE(json.status().message().find("follow the last member"), std::string::npos)
        << topic->type_name << ": " << json.status().message();
  }
}

TEST(TypeCatalogue, AForeignTypeIsNotKnown) { EXPECT_FALSE(type_of("acme::Unheard")); }

TEST(TypeCatalogue, KeysComeFromTheIdl) {
  std::string keys;
  for (const auto& member : type_of("phantom::msg::WorkspaceBrick")->members)
    keys += member.key ? member.name + " " : "";
  EXPECT_EQ(keys, "bx by bz ");
}

TEST(TypeCatalogue, APerceptComesBackWithNamesOfItsEnums) {
  msg::Percept percept;
  percept.stamp().sequence_number(42);
  percept.stamp().session(0xfedcba9876543210U);
  percept.condition(msg::PerceptCondition::PERCEPT_WORKSPACE_STALE);
  percept.motion(msg::MotionClass::MOTION_DANGEROUS);
  percept.closeness(std::nan(""));
  percept.pgv().y(-0.25);
  percept.drag_torque_Nm()[2] = 1.5;
  const auto json = decoded(dds::kPercept, percept);
  EXPECT_EQ(json["stamp"]["sequence_number"], 42);
  EXPECT_EQ(json["stamp"]["session"], 0xfedcba9876543210U);
  EXPECT_EQ(json["condition"], "PERCEPT_WORKSPACE_STALE");
  EXPECT_EQ(json["motion"], "MOTION_DANGEROUS");
  EXPECT_EQ(json["closeness"], "NaN");
  EXPECT_EQ(json["pgv"].dump(), R"({"x":0.0,"y":-0.25,"z":0.0})");
  EXPECT_EQ(json["drag_torque_Nm"].size(), 16u);
  EXPECT_EQ(json["drag_torque_Nm"][2], 1.5);
}

TEST(TypeCatalogue, SequencesOfStructsComeBack) {
  msg::ComponentStatus status;
  status.component_name("slave_io");
  status.host("desk");
  status.state(msg::ComponentState::COMPONENT_DEGRADED);
  for (int i = 0; i < 3; ++i) {
    msg::Figure figure;
    figure.name("figure " + std::to_string(i));
    figure.value(0.5 * i);
    figure.unit("µs");
    status.figures().push_back(figure);
  }
  const auto json = decoded(dds::kComponentStatus, status);
  EXPECT_EQ(json["state"], "COMPONENT_DEGRADED");
  EXPECT_EQ(json["figures"].dump(),
            R"([{"name":"figure 0","value":0.0,"unit":"µs"},{"name":"figure 1","value":0.5,"unit":"µs"},)"
            R"({"name":"figure 2","value":1.0,"unit":"µs"}])");
  EXPECT_EQ(diagnostics::instance_name(*type_of("phantom::msg::ComponentStatus"), json),
            "component_name=slave_io, host=desk");
}

TEST(TypeCatalogue, FloatsReadAsTheyWereWritten) {
  msg::WorkspaceVersion version;
  version.palette({0.0F, 0.1F, 32.7F});
  EXPECT_EQ(decoded(dds::kWorkspaceVersion, version)["palette"].dump(), "[0.0,0.1,32.7]");
}

}  // namespace
}  // namespace phantom::observation
