#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/dds/endpoints/topic_list.hpp"

namespace phantom::dds {
namespace {

std::string milliseconds(int value_ms) { return value_ms == 0 ? "–" : std::to_string(value_ms) + " ms"; }

std::string topic_table() {
  std::string table =
      "| topic | type | reliability | durability | depth | deadline | liveliness |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const TopicDescription* topic : all_topics()) {
    const QosContract& qos = topic->qos;
    table += "| `" + std::string(topic->name) + "` | `" + topic->type_name + "` | " +
             (qos.reliability == Reliability::kReliable ? "reliable" : "best effort") + " | " +
             (qos.durability == Durability::kTransientLocal ? "transient local" : "volatile") + " | " +
             std::to_string(qos.history_depth) + " | " + milliseconds(qos.deadline_ms) + " | " +
             milliseconds(qos.liveliness_ms) + " |\n";
  }
  return table;
}

TEST(Readme, TopicTableSaysWhatTheContractsSay) {
  std::ifstream file(PHANTOM_SOURCE_DIR "/idl/README.md");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string readme = text.str(),
                    begin = "kept equal to common/dds/endpoints/topics.cpp by a test -->\n",
                    end = "<!-- /topics -->";
  const auto from = readme.find(begin);
  const auto to = readme.find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos);
  EXPECT_EQ(readme.substr(from + begin.size(), to - from - begin.size()), topic_table())
      << "the table to put there:\n"
      << topic_table();
}

}  // namespace
}  // namespace phantom::dds
