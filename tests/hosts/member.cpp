// A participant that opens the ends of a component, as the IDL grants them, and is silent: what
// its being there costs the network is discovery alone. Prints "up", then for each line that it reads how
// many ends of others it has matched.
#include <cstring>
#include <iostream>
#include <list>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"

namespace {

using namespace phantom;

const dds::TopicDescription& topic_called(const std::string& name) {
  for (const dds::TopicDescription* topic : dds::all_topics()) {
    if (name == topic->name) return *topic;
  }
  throw core::ConfigError(name + ": no topic of the project");
}

}  // namespace

int main(int argc, char** argv) {
  std::string name;
  std::vector<std::string> writes, reads;
  runtime::ProcessDescription description;
  description.name = "member";
  description.summary = "A silent participant with the ends of a component, for measuring discovery.";
  description.add_options = [&](runtime::Command app) {
    app.option("--as", name, "that it has in the domain").required();
    app.option("--writes", writes, "topics");
    app.option("--reads", reads, "topics");
  };
  description.run = [&](const runtime::ProcessOptions& options) {
    const auto deployment = runtime::load_deployment(options);
    dds::Participant participant(name, deployment.network);
    std::list<dds::RawWriter> writers;
    std::list<dds::RawReader> readers;
    for (const auto& topic : writes) writers.emplace_back(participant, topic_called(topic));
    for (const auto& topic : reads)
      readers.emplace_back(participant, topic_called(topic),
                           [](const void*, const dds::SampleInfo&) { return true; });
    std::cout << "up" << std::endl;
    for (std::string line; std::getline(std::cin, line);) {
      std::uint64_t matched = 0;
      for (const auto& writer : writers) matched += writer.matched();
      for (const auto& reader : readers) matched += reader.matched();
      std::cout << matched << std::endl;
    }
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
