#include "common/runtime/config_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

ConfigReader read_text(const std::string& yaml) { return ConfigReader::from_text(yaml, "arm.yaml"); }

TEST(ConfigReader, ReadsEveryKind) {
  const auto file = read_text(
      "rate_hz: 1000\nname: wall\non: true\nlist: [1, 2]\npoint: [1, 2, 3]\n"
      "mount: {xyz_m: [1, 0, 0], rpy_deg: [0, 0, 90]}\nparts: [{a: 1}, {a: 2}]\nmesh: m/a.stl\n");
  EXPECT_EQ(file.number("rate_hz", {1, 4000, "Hz"}), 1000.0);
  EXPECT_EQ(file.integer("absent", 7), 7);
  EXPECT_EQ(file.text("name"), "wall");
  EXPECT_TRUE(file.flag("on", false));
  EXPECT_EQ(file.integers("list").size(), 2u);
  EXPECT_EQ(file.vector3("point").z(), 3.0);
  const auto mount = file.pose("mount");
  EXPECT_NEAR((mount * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 1, 0)).norm(), 0.0, 1e-12);
  std::vector<int> parts;
  for (const auto& part : file.sections("parts")) parts.push_back(part.integer("a"));
  EXPECT_EQ(parts, (std::vector<int>{1, 2}));
  EXPECT_EQ(file.path("mesh"), std::filesystem::path("m/a.stl"));
  EXPECT_NO_THROW(file.finish());
}

TEST(ConfigReader, EveryFaultNamesFileLineKeyValueAndWhatIsAllowed) {
  const auto file = read_text(
      "a: 1\nrate_hz: 9000\nname: [1]\nmode: fast\npoint: [1, 2]\nnan: .nan\ntext: abc\nhalf: 0.5\n");
  EXPECT_THAT(
      [&] {
        file.number("rate_hz", {1, 4000, "Hz"});
      },
      ThrowsMessage<ConfigError>("arm.yaml:2: rate_hz: '9000' is out of range; allowed: 1 to 4000 Hz"));
  EXPECT_THAT([&] { file.number("gone"); },
              ThrowsMessage<ConfigError>(AllOf(HasSubstr("gone"), HasSubstr("missing"))));
  EXPECT_THAT([&] { file.text("name"); }, ThrowsMessage<ConfigError>(HasSubstr("arm.yaml:3: name:")));
  EXPECT_THAT(
      [&] {
        file.choice("mode", "slow", {"slow", "quick"});
      },
      ThrowsMessage<ConfigError>("arm.yaml:4: mode: 'fast' is not known; allowed: slow, quick"));
  EXPECT_THAT([&] { file.vector3("point"); },
              ThrowsMessage<ConfigError>(HasSubstr("has 2 numbers; allowed: three")));
  EXPECT_THROW(file.number("nan"), ConfigError);
  EXPECT_THROW(file.number("text"), ConfigError);
  EXPECT_THROW(file.integer("half"), ConfigError);
}

TEST(ConfigReader, TextMustBeUtf8) {
  EXPECT_EQ(read_text("name: gefäß 部品\n").text("name"), "gefäß 部品");
  // Latin 1; cut short; overlong; a surrogate; beyond Unicode.
  for (const char* bytes : {"caf\xe9", "\xe9\x83", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"}) {
    EXPECT_THAT([&] { read_text("name: part\nnote: " + std::string(bytes) + "\n"); },
                ThrowsMessage<ConfigError>("arm.yaml:2: holds a byte that is no text; allowed: UTF-8"))
        << bytes;
  }
}

TEST(ConfigReader, WhatIsNoFileIsRefusedAsThat) {
  EXPECT_THAT([] { ConfigReader::from_file("/"); },
              ThrowsMessage<ConfigError>("/: is a folder; allowed: a file"));
  EXPECT_THAT([] { ConfigReader::from_file("/dev/zero"); }, ThrowsMessage<ConfigError>(HasSubstr("64 MiB")));
}

TEST(ConfigReader, UnknownAndRepeatedKeysAreRefusedAlsoWhenNested) {
  const auto file = read_text("staleness_s: 1\nloop: {rat_hz: 3}\n");
  file.number("staleness_s");
  const auto loop = file.section("loop");
  loop.number("rate_hz", 1.0);
  EXPECT_THAT([&] { file.finish(); },
              ThrowsMessage<ConfigError>(
                  "arm.yaml:2: loop.rat_hz: unknown key (did you mean rate_hz?); allowed: rate_hz"));
  const auto twice = read_text("a: 1\na: 2\n");
  twice.number("a");
  EXPECT_THAT([&] { twice.finish(); }, ThrowsMessage<ConfigError>(HasSubstr("stands twice")));
}

TEST(ConfigReader, BrokenFilesAreRefused) {
  EXPECT_THAT([] { read_text("a: [1, 2\nb: 3"); }, ThrowsMessage<ConfigError>(HasSubstr("not valid YAML")));
  EXPECT_THAT([] { read_text("- 1\n- 2\n"); }, ThrowsMessage<ConfigError>(HasSubstr("must be a mapping")));
  EXPECT_THAT([] { ConfigReader::from_file("/nowhere/x.yaml"); },
              ThrowsMessage<ConfigError>(HasSubstr("/nowhere/x.yaml: cannot be read")));
}

}  // namespace
}  // namespace phantom::runtime
