#include "common/runtime/configuration/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

enum class Mood { kCalm, kBrisk };

constexpr const char* kCartTable = R"(# A cart: how long it is,
# and how it goes.

length_mm: 250           # [1 to 1000 mm] from end to end,
                         # seats: not a key, as the comment goes on
angle_deg: 5             # [required: -90 to 90 deg]
name: ""                 # may be: anything
weights: []              # [0 to 1 kg]
load: {left: 1}          # [0 to 9 kg] by name
seat_m: [0, 0.5, -1]
ride:                    # how it goes
  pause_s: 2             # [0 to 10 s; 0: none; left out: 3] at each stop
  seats: 4               # [1 to 9]
  bell: true
  mood: calm             # [calm, brisk]
  # joints:              # of single joints
  #   NAME:
  #     gain: 1          # [required: 0 to 5]
wheels:
  - node: 1              # [required: 1 to 127]
    radius_m: 0.1        # [0 to 1 m]
  - node: 2
# brake:
#   force_N: 3           # [0 to 100 N]
)";

struct Wheel {
  int node = 0;
  double radius_m = 0.25;
};

struct Cart {
  double length_m = 0.25, angle_rad = 0.0, force_N = 0.0;
  long pause_ns = 3'000'000'000;
  std::size_t seats = 2;
  bool bell = true;
  std::string name = "none";
  Mood mood = Mood::kCalm;
  std::vector<double> weights;
  std::map<std::string, double> load{{"none", 0}};
  Eigen::Vector3d seat_m{0, 0.5, -1};
  std::vector<Wheel> wheels;
  double gains[2] = {1, 1};
};

Cart cart(const std::string& yaml) {
  const Fields file(test::new_file(yaml), {kCartTable});
  Cart cart;
  file.number("length_mm", cart.length_m, 1e-3);
  file.number("angle_deg", cart.angle_rad, 0.01);
  file.text("name", cart.name);
  file.numbers("weights", cart.weights);
  file.numbers("load", cart.load);
  file.vector3("seat_m", cart.seat_m);
  const Fields ride = file.section("ride");
  ride.number("pause_s", cart.pause_ns, 1e9);
  ride.check(cart.pause_ns != 4'000'000'000, "pause_s", "is four; allowed: anything else");
  ride.number("seats", cart.seats);
  ride.flag("bell", cart.bell);
  ride.choice("mood", cart.mood, {{"calm", Mood::kCalm}, {"brisk", Mood::kBrisk}});
  ride.named("joints", {"left", "right"},
             [&](const Fields& own, std::size_t j) { own.number("gain", cart.gains[j]); });
  for (const Fields& item : file.sections("wheels")) {
    Wheel& wheel = cart.wheels.emplace_back();
    item.number("node", wheel.node);
    item.number("radius_m", wheel.radius_m);
  }
  file.section("brake").number("force_N", cart.force_N);
  file.finish();
  return cart;
}

TEST(Fields, ReadEveryKindAndLeaveTheMemberWhereAKeyIsMissing) {
  const Cart all = cart(
      "length_mm: 500\nangle_deg: 30\nride: {pause_s: 0.2, seats: 3, bell: false, mood: brisk, joints: "
      "{right: {gain: 3}}}\nname: Ann\nload: {a: 2, b c: 0.5}\nweights: [0.5, 1]\nseat_m: [1, 2, 3]\nwheels: [{node: 7}, {node: "
      "8, radius_m: 0.3}]\nbrake: {force_N: 9}\n");
  EXPECT_DOUBLE_EQ(all.length_m, 0.5);
  EXPECT_DOUBLE_EQ(all.angle_rad, 0.3);
  EXPECT_EQ(all.pause_ns, 200'000'000);
  EXPECT_EQ(all.seats, 3u);
  EXPECT_FALSE(all.bell);
  EXPECT_EQ(all.mood, Mood::kBrisk);
  EXPECT_EQ(all.name, "Ann");
  EXPECT_EQ(all.weights, (std::vector<double>{0.5, 1}));
  EXPECT_EQ(all.load, (std::map<std::string, double>{{"a", 2}, {"b c", 0.5}}));
  EXPECT_EQ(all.seat_m, Eigen::Vector3d(1, 2, 3));
  ASSERT_EQ(all.wheels.size(), 2u);
  EXPECT_EQ(all.wheels[0].node, 7);
  EXPECT_EQ(all.wheels[0].radius_m, 0.25);
  EXPECT_EQ(all.wheels[1].radius_m, 0.3);
  EXPECT_EQ(all.gains[0], 1);
  EXPECT_EQ(all.gains[1], 3);
  EXPECT_EQ(all.force_N, 9);
  const Cart least = cart("angle_deg: 0");
  EXPECT_EQ(least.length_m, 0.25);
  EXPECT_EQ(least.pause_ns, 3'000'000'000);
  EXPECT_EQ(least.name, "none");
  EXPECT_EQ(least.load.count("none"), 1U);
  EXPECT_TRUE(least.wheels.empty());
}

TEST(Fields, TheTableIsAFileItself) {
  const Cart shipped = cart(kCartTable);
  EXPECT_DOUBLE_EQ(shipped.angle_rad, 0.05);
  EXPECT_EQ(shipped.seats, 4u);
  EXPECT_EQ(shipped.wheels.size(), 2u);
  EXPECT_EQ(shipped.force_N, 0.0) << "a comment";
}

TEST(Fields, EveryFaultNamesFileLineKeyValueAndWhatTheTableAllows) {
  const auto refused = [](const std::string& yaml, const std::string& expected) {
    EXPECT_THAT([&] { cart("angle_deg: 1\n" + yaml); },
                ThrowsMessage<ConfigError>(HasSubstr(".yaml:2: " + expected)));
  };
  refused("length_mm: 0.5", "length_mm: '0.5' is out of range; allowed: 1 to 1000 mm");
  refused("weights: [2]", "weights: is out of range; allowed: 0 to 1 kg");
  refused("load: {a: 1, b: 10}", "load.b: '10' is out of range; allowed: 0 to 9 kg");
  refused("load: {a: x}", "load.a: 'x' is not a number; allowed: 0 to 9 kg");
  refused("load: {a: 1, a: 2}", "load.a: '1' stands twice");
  refused("load: [1]", "load: is a list; allowed: a mapping");
  refused("load: {[1]: 1}", "load: holds a name that is not a text");
  refused("ride: {seats: 2.5}", "ride.seats: '2.5' is not a whole number");
  refused("ride: {pause_s: -1}", "ride.pause_s: '-1' is out of range; allowed: 0 to 10 s; 0: none");
  refused("ride: {pause_s: 4}", "ride.pause_s: '4' is four; allowed: anything else");
  refused("ride: {bell: perhaps}", "ride.bell: 'perhaps' is not true or false");
  refused("ride: {mood: sad}", "ride.mood: 'sad' is not known; allowed: calm, brisk");
  refused("ride: 3", "ride: '3' is '3'; allowed: a mapping");
  refused("wheels: [{node: 300}]", "wheels[0].node: '300' is out of range; allowed: 1 to 127");
  refused("wheels: [{node: 3, nodes: 3}]",
          "wheels[0].nodes: unknown key (did you mean node?); allowed: node, radius_m");
  refused("ride: {joints: {middle: {gain: 1}}}", "ride.joints.middle: unknown key; allowed: left, right");
  refused("ride: {joints: {left: {}}}", "ride.joints.left.gain: is missing; allowed: 0 to 5");
  refused("brake: {force_N: 101}", "brake.force_N: '101' is out of range; allowed: 0 to 100 N");
  EXPECT_THAT([] { cart("name: Ann"); },
              ThrowsMessage<ConfigError>(HasSubstr("angle_deg: is missing; allowed: -90 to 90 deg")));
}

TEST(Fields, WhatTheTableDoesNotHaveIsAMistakeOfTheCode) {
  const Fields file(test::new_file("{}"), {kCartTable});
  int number = 0;
  EXPECT_THROW(file.number("seats", number), std::logic_error)
      << "it stands in section ride, and in a comment";
  EXPECT_THROW(file.section("ride").choice("mood", number, {{"brisk", 1}, {"calm", 2}}), std::logic_error);
}

Fields read_text(const std::string& yaml) {
  return Fields::from_text(yaml, "arm.yaml", {R"(
rate_hz: 1    # [required: 1 to 4000 Hz]
name: ""      # [required]
long: ""      # [1 to 8 bytes]
on: true
list: []
point: []
mount: {}
parts: []
  - a: 1
mesh: a.stl   # [or: box, ball]
box: 1
ball: 2
mode: slow    # [slow, quick]
gone: 1       # [required]
nan: 1
text: 1
half: 1
a: 1
loop:
  rate_hz: 1
)"});
}

TEST(StrictYaml, ReadsEveryKind) {
  const Fields file = read_text(
      "rate_hz: 1000\nname: wall\non: true\nlist: [1, 2]\npoint: [1, 2, 3]\n"
      "mount: {xyz_m: [1, 0, 0], rpy_deg: [0, 0, 90]}\nparts: [{a: 1}, {a: 2}]\nmesh: m/a.stl\n");
  EXPECT_EQ(file.value("rate_hz"), 1000.0);
  EXPECT_EQ(file.value("half", 7), 7);
  EXPECT_EQ(file.text("name"), "wall");
  bool on = false;
  file.flag("on", on);
  EXPECT_TRUE(on);
  std::vector<int> list;
  file.numbers("list", list);
  EXPECT_EQ(list.size(), 2u);
  EXPECT_EQ(file.vector3("point").z(), 3.0);
  const auto mount = file.pose("mount");
  EXPECT_NEAR((mount * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 1, 0)).norm(), 0.0, 1e-12);
  std::vector<double> parts;
  for (const Fields& part : file.sections("parts")) parts.push_back(part.value("a"));
  EXPECT_EQ(parts, (std::vector<double>{1, 2}));
  EXPECT_EQ(file.path("mesh"), std::filesystem::path("m/a.stl"));
  EXPECT_EQ(file.one_of("mesh"), "mesh");
  EXPECT_NO_THROW(file.finish());
}

TEST(StrictYaml, EveryFaultNamesFileLineKeyValueAndWhatIsAllowed) {
  const Fields file = read_text(
      "a: 1\nrate_hz: 9000\nname: [1]\nmode: fast\npoint: [1, 2]\nnan: .nan\ntext: abc\nhalf: 0.5\n"
      "box: 1\nball: 2\nlong: far too long\n");
  EXPECT_THAT(
      [&] { file.value("rate_hz"); },
      ThrowsMessage<ConfigError>("arm.yaml:2: rate_hz: '9000' is out of range; allowed: 1 to 4000 Hz"));
  EXPECT_THAT([&] { file.value("gone"); },
              ThrowsMessage<ConfigError>(AllOf(HasSubstr("gone"), HasSubstr("missing"))));
  EXPECT_THAT([&] { file.text("name"); }, ThrowsMessage<ConfigError>(HasSubstr("arm.yaml:3: name:")));
  EXPECT_THAT([&] { file.text("long"); },
              ThrowsMessage<ConfigError>(HasSubstr("has 12 bytes; allowed: 1 to 8 bytes")));
  int mode = 0;
  EXPECT_THAT(
      [&] {
        file.choice("mode", mode, {{"slow", 1}, {"quick", 2}});
      },
      ThrowsMessage<ConfigError>("arm.yaml:4: mode: 'fast' is not known; allowed: slow, quick"));
  EXPECT_THAT([&] { file.vector3("point"); },
              ThrowsMessage<ConfigError>(HasSubstr("has 2 numbers; allowed: three")));
  EXPECT_THAT([&] { file.one_of("mesh"); },
              ThrowsMessage<ConfigError>(
                  "arm.yaml:10: ball: '2' stands beside box; allowed: one of mesh, box, ball"));
  EXPECT_THAT([] { read_text("a: 1").one_of("mesh", "shape"); },
              ThrowsMessage<ConfigError>("arm.yaml:1: names no shape; allowed: one of mesh, box, ball"));
  EXPECT_THROW(file.value("nan"), ConfigError);
  EXPECT_THROW(file.value("text"), ConfigError);
  int half = 0;
  EXPECT_THROW(file.number("half", half), ConfigError);
}

TEST(StrictYaml, TextMustBeUtf8) {
  EXPECT_EQ(read_text("name: gefäß 部品\n").text("name"), "gefäß 部品");
  // Latin 1; cut short; overlong; a surrogate; beyond Unicode.
  for (const char* bytes : {"caf\xe9", "\xe9\x83", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"}) {
    EXPECT_THAT([&] { read_text("name: part\nnote: " + std::string(bytes) + "\n"); },
                ThrowsMessage<ConfigError>("arm.yaml:2: holds a byte that is no text; allowed: UTF-8"))
        << bytes;
  }
}

TEST(StrictYaml, WhatIsNoFileIsRefusedAsThat) {
  const FieldTable none{};
  EXPECT_THAT([&] { Fields("/", none); }, ThrowsMessage<ConfigError>("/: is a folder; allowed: a file"));
  EXPECT_THAT([&] { Fields("/dev/zero", none); }, ThrowsMessage<ConfigError>(HasSubstr("64 MiB")));
  EXPECT_THAT([&] { Fields("/nowhere/x.yaml", none); },
              ThrowsMessage<core::MissingError>(HasSubstr("/nowhere/x.yaml: cannot be read")));
}

TEST(StrictYaml, UnknownAndRepeatedKeysAreRefusedAlsoWhenNested) {
  const Fields file = read_text("half: 1\nloop: {rat_hz: 3}\n");
  file.value("half");
  file.section("loop").value("rate_hz", 1.0);
  EXPECT_THAT([&] { file.finish(); },
              ThrowsMessage<ConfigError>(
                  "arm.yaml:2: loop.rat_hz: unknown key (did you mean rate_hz?); allowed: rate_hz"));
  const Fields twice = read_text("a: 1\na: 2\n");
  twice.value("a");
  EXPECT_THAT([&] { twice.finish(); }, ThrowsMessage<ConfigError>(HasSubstr("stands twice")));
}

TEST(StrictYaml, BrokenFilesAreRefused) {
  EXPECT_THAT([] { read_text("a: [1, 2\nb: 3"); }, ThrowsMessage<ConfigError>(HasSubstr("not valid YAML")));
  EXPECT_THAT([] { read_text("- 1\n- 2\n"); }, ThrowsMessage<ConfigError>(HasSubstr("must be a mapping")));
}

TEST(FieldsDocuments, ASecondDocumentIsRefusedWithItsLine) {
  const FieldTable table({"a: 1  # [0 to 9]\n"});
  EXPECT_NO_THROW(Fields::from_text("---\na: 1\n...\n", "one.yaml", table));
  EXPECT_THAT(
      [&] { Fields::from_text("a: 1\n---\na: 2\n", "two.yaml", table); },
      testing::ThrowsMessage<core::ConfigError>(testing::HasSubstr("two.yaml:3: a second YAML document")));
}

}  // namespace
}  // namespace phantom::runtime
