#include "components/dds_recorder/convert.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>

#include "common/core/errors.hpp"
#include "common/diagnostics/decode.hpp"
#include "common/observation/type_catalogue.hpp"
#include "common/recording/mcap_writer.hpp"
#include "common/ros2/introspection.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_recorder/recording_file.hpp"

namespace phantom::dds_recorder {
namespace {

struct Target : RecordingListener {
  virtual void end() = 0;
};

class McapTarget : public Target {
 public:
  McapTarget(const std::filesystem::path& path, int zstd_level)
      : sink_(must(recording::FileSink::create(path))), writer_(*sink_, {.zstd_level = zstd_level}) {}

  void begin(const recording::McapReader& from) override {
    from_ = &from;
    channels_.clear();
    for (const auto& index : from.metadata_indexes()) {
      if (const auto metadata = from.read(index)) must(writer_.write(*metadata));
    }
    for (const auto& index : from.attachment_indexes()) {
      if (const auto attachment = from.read(index)) must(writer_.write(*attachment));
    }
  }
  void take(const recording::Channel& channel, const recording::Message& message, bool) override {
    recording::Message out = message;
    out.channel_id = channel_for(channel);
    must(writer_.write(out));
  }
  void end() override {
    must(writer_.finish());
    must(sink_->sync());
  }

 private:
  static void must(const core::Status& status) {
    if (!status) throw std::runtime_error(status.message());
  }
  template <class T>
  static T must(core::Expected<T> value) {
    must(value.status());
    return std::move(value).value();
  }
  std::uint16_t channel_for(const recording::Channel& channel) {
    if (const auto known = channels_.find(channel.id); known != channels_.end()) return known->second;
    recording::Channel copy = channel;
    copy.id = 0;
    copy.schema_id = 0;
    if (const auto schema = from_->schemas().find(channel.schema_id); schema != from_->schemas().end())
      copy.schema_id = schema_for(schema->second);
    // The same topic and writer in several files of a series share one channel.
    for (const auto& [same, id] : written_) {
      if (same == copy) return channels_[channel.id] = id;
    }
    written_.emplace_back(copy, must(writer_.add_channel(copy)));
    return channels_[channel.id] = written_.back().second;
  }
  std::uint16_t schema_for(recording::Schema schema) {
    schema.id = 0;
    for (const auto& [same, id] : schemas_) {
      if (same == schema) return id;
    }
    schemas_.emplace_back(schema, must(writer_.add_schema(schema)));
    return schemas_.back().second;
  }

  std::unique_ptr<recording::FileSink> sink_;
  recording::McapWriter writer_;
  const recording::McapReader* from_ = nullptr;
  std::map<std::uint16_t, std::uint16_t> channels_;  // by the channel's id in the file that is being read
  std::vector<std::pair<recording::Channel, std::uint16_t>> written_;
  std::vector<std::pair<recording::Schema, std::uint16_t>> schemas_;
};

class JsonTarget : public Target {
 public:
  explicit JsonTarget(const std::filesystem::path& path) : path_(path), stream_(path) {}
  void take(const recording::Channel& channel, const recording::Message& message, bool) override {
    nlohmann::ordered_json line{{"topic", channel.topic},
                                {"log_time_ns", message.log_time_ns},
                                {"publish_time_ns", message.publish_time_ns},
                                {"sequence", message.sequence},
                                {"component", metadata_of(channel, "component")}};
    auto type = observation::type_of(metadata_of(channel, "type"));
    if (!type) type = ros2::type_tree(metadata_of(channel, "type"));
    if (is_carried_over(channel)) line["carried_over"] = true;
    if (!type) {
      line["type"] = metadata_of(channel, "type");
      line["bytes"] = message.data.size();
    } else if (auto decoded = diagnostics::decode(*type, message.data, {.most_octets = 0})) {
      line["sample"] = std::move(decoded).value();
    } else {
      line["problem"] = decoded.status().message();
    }
    stream_ << line.dump() << '\n';
  }
  void end() override {
    if (!stream_.flush()) throw std::runtime_error(path_.string() + ": cannot be written");
  }

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

std::unique_ptr<Target> target_for(const ConvertRequest& request, const std::filesystem::path& path) {
  if (request.out.extension() == ".jsonl") return std::make_unique<JsonTarget>(path);
  return std::make_unique<McapTarget>(path, request.zstd_level);
}

}  // namespace

int run_convert(const ConvertRequest& request, std::ostream& notes) {
  if (request.out.extension() != ".mcap" && request.out.extension() != ".jsonl")
    throw core::ConfigError("--out " + request.out.string() +
                            ": allowed: a name that ends with .mcap or .jsonl");
  const auto opened = open_recordings(recordings_in(request.files));
  ReadFigures read;
  write_whole(request.out, [&](const std::filesystem::path& partial) {
    const auto target = target_for(request, partial);
    read = read_all(opened, in_range(request.range, times_of(opened).first),
                    diagnostics::NameFilter(request.topics), *target, notes);
    check_any_read(read);
    target->end();
    notes << request.out.string() << ": " << read.samples << " samples\n";
  });
  return exit_code_of(read, request.out.string(), notes);
}

}  // namespace phantom::dds_recorder
