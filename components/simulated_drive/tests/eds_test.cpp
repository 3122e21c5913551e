// The shipped data sheet against the drive itself: read as a CANopen tool would, asked for over the bus.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <sstream>

#include "common/can/sdo_client.hpp"
#include "components/simulated_drive/simulated_drive.hpp"
#include "tests/support/files.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::simulated_drive {
namespace {

constexpr int kNode = 5;

std::string shipped_text() {
  return test::text_of(PHANTOM_SOURCE_DIR "/components/simulated_drive/simulated_drive.eds");
}

using Section = std::map<std::string, std::string>;

std::map<std::string, Section> parse(const std::string& text) {
  std::map<std::string, Section> sections;
  std::istringstream stream(text);
  std::string name;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty()) continue;
    if (line.front() == '[') {
      name = line.substr(1, line.find(']') - 1);
      EXPECT_FALSE(sections.contains(name)) << name << " twice";
      sections[name];
      continue;
    }
    const auto equals = line.find('=');
    EXPECT_NE(equals, std::string::npos) << line;
    sections[name][line.substr(0, equals)] = line.substr(equals + 1);
  }
  return sections;
}

std::int64_t number(std::string text) {
  std::int64_t sum = 0;
  if (text.rfind("$NODEID+", 0) == 0) {
    sum = kNode;
    text.erase(0, 8);
  }
  return sum + std::stoll(text, nullptr, 0);
}

std::size_t bytes_of(int data_type) {
  const std::map<int, std::size_t> sizes{{0x2, 1}, {0x3, 2}, {0x4, 4}, {0x5, 1}, {0x6, 2}, {0x7, 4}};
  return sizes.at(data_type);
}

/// A drive and whoever asks it, on one bus.
struct EdsRig {
  EdsRig() {
    DriveOptions options;
    options.node = kNode;
    drive.emplace(options, bus.connect("drive"));
    drive->step(now_ns);
  }
  void finish(can::SdoClient& client) {
    while (client.state() == can::SdoClient::State::kBusy) {
      if (const auto frame = client.poll(now_ns)) port->send(*frame);
      now_ns += core::kNsPerMillisecond;
      bus.advance_to(now_ns);
      drive->step(now_ns);
      bus.advance_to(now_ns);
      for (can::Received r; port->receive(r);) client.on_frame(r.frame, now_ns);
    }
  }
  simulation::LocalBus bus;
  std::unique_ptr<can::CanBus> port = bus.connect("tool");
  std::optional<SimulatedDrive> drive;
  core::Nanoseconds now_ns = core::kNsPerSecond;
};

TEST(Eds, TheShippedFileIsTheDictionarys) { EXPECT_EQ(shipped_text(), std::string(kDataSheet) + "\n"); }

TEST(Eds, EveryObjectAnswersOverTheBusAsTheFileSays) {
  const auto sections = parse(shipped_text());
  EdsRig rig;
  can::SdoClient client(kNode, 100 * core::kNsPerMillisecond);
  int requested = 0;
  for (const auto& [name, section] : sections) {
    if (!section.contains("DataType")) continue;
    SCOPED_TRACE(name);
    const auto index = static_cast<std::uint16_t>(std::stoi(name, nullptr, 16));
    const auto at = name.find("sub");
    const auto sub =
        static_cast<std::uint8_t>(at == std::string::npos ? 0 : std::stoi(name.substr(at + 3), nullptr, 16));
    client.start_read(index, sub, rig.now_ns);
    rig.finish(client);
    ASSERT_EQ(client.state(), can::SdoClient::State::kDone);
    const std::vector<std::uint8_t> value(client.data().begin(), client.data().end());
    const int type = std::stoi(section.at("DataType"), nullptr, 0);
    if (type == 0x9) {
      EXPECT_EQ(std::string(value.begin(), value.end()), section.at("DefaultValue"));
    } else {
      ASSERT_EQ(value.size(), bytes_of(type));
      const std::int64_t due = number(section.at("DefaultValue"));
      for (std::size_t i = 0; i < value.size(); ++i)
        EXPECT_EQ(value[i], static_cast<std::uint8_t>(due >> (8 * i)));
    }
    ++requested;
    if (value.empty()) continue;                        // an empty label
    client.start_write(index, sub, value, rig.now_ns);  // what it has already
    rig.finish(client);
    const bool read_only =
        client.state() == can::SdoClient::State::kAborted && client.abort_code() == 0x06010002;
    EXPECT_EQ(read_only, section.at("AccessType") == "ro") << std::hex << client.abort_code();
  }
  EXPECT_EQ(requested, static_cast<int>(rig.drive->dictionary().objects().size()))
      << "every object is in the file";
}

TEST(Eds, ListsNameEverySectionOnce) {
  const auto sections = parse(shipped_text());
  std::size_t listed = 0;
  for (const char* list : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    const Section& of = sections.at(list);
    const int count = std::stoi(of.at("SupportedObjects"));
    for (int i = 1; i <= count; ++i) {
      const std::string name = of.at(std::to_string(i)).substr(2);
      ASSERT_TRUE(sections.contains(name)) << name;
      ++listed;
      if (!sections.at(name).contains("SubNumber")) continue;
      const int subs = std::stoi(sections.at(name).at("SubNumber"));
      int found = 0;
      for (const auto& [other, section] : sections) found += other.rfind(name + "sub", 0) == 0 ? 1 : 0;
      EXPECT_EQ(found, subs) << name;
    }
  }
  std::size_t objects = 0;
  for (const auto& [name, section] : sections)
    objects += section.contains("ObjectType") && name.find("sub") == std::string::npos ? 1 : 0;
  EXPECT_EQ(listed, objects);
}

}  // namespace
}  // namespace phantom::simulated_drive
