#include "components/wva_server/dds_adapter_client.hpp"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>

#include "common/dds/endpoint.hpp"
#include "components/wva_server/dds_adapter_convert.hpp"

namespace phantom::wva_server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kAgain(500);  // a reply may have been sent before we could hear it
constexpr std::chrono::milliseconds kNotMatched(20);

std::string requester_name() {
  char host[65] = {};
  gethostname(host, sizeof host - 1);
  return "wva_server command, process " + std::to_string(getpid()) + " on " + host;
}

}  // namespace

struct CommandClient::Impl {
  explicit Impl(const core::NetworkOptions& network) : participant("wva_server_command", network) {}

  dds::Participant participant;
  dds::Stamper stamper{participant};
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<msg::WorkspaceReply> replies;

  dds::Writer<msg::WorkspaceCommand> commands{participant, dds::kWorkspaceCommand};
  dds::Reader<msg::WorkspaceReply> reader{
      participant, dds::kWorkspaceReply, [this](const msg::WorkspaceReply& reply, const dds::SampleInfo&) {
        {
          const std::lock_guard lock(mutex);
          replies.push_back(reply);
        }
        changed.notify_one();
      }};
};

CommandClient::CommandClient(const core::NetworkOptions& network) : impl_(std::make_unique<Impl>(network)) {}
CommandClient::~CommandClient() = default;

std::optional<Reply> CommandClient::ask(const CellCommand& command, double timeout_s,
                                        const std::function<void(const Reply&)>& on_accepted) {
  msg::WorkspaceCommand message = to_message(command, requester_name());
  message.stamp(impl_->stamper.next());
  const auto timeout = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
  auto give_up = Clock::now() + timeout, say_again = Clock::now();
  std::string said;
  while (Clock::now() < give_up) {
    if (Clock::now() >= say_again) {
      const bool heard = impl_->commands.matched() > 0 && impl_->reader.matched() > 0;
      if (heard) impl_->commands.write(message);
      say_again = Clock::now() + (heard ? kAgain : kNotMatched);
    }
    std::unique_lock lock(impl_->mutex);
    impl_->changed.wait_until(lock, std::min(give_up, say_again), [this] { return !impl_->replies.empty(); });
    std::deque<msg::WorkspaceReply> replies;
    replies.swap(impl_->replies);
    lock.unlock();
    for (const msg::WorkspaceReply& reply : replies) {
      const auto& echo = reply.command();
      if (echo.session() != message.stamp().session() || echo.sequence_number() != message.stamp().sequence_number())
        continue;  // somebody else's
      const Reply heard = to_reply(reply);
      if (heard.outcome != Outcome::kAccepted) return heard;
      if (heard.message != said) on_accepted(heard);
      said = heard.message;
      give_up = Clock::now() + timeout;
    }
  }
  return std::nullopt;
}

std::optional<Listing> CommandClient::list(double timeout_s) {
  std::mutex mutex;
  std::condition_variable changed;
  Listing listing;
  std::map<std::uint16_t, ListedObject> objects;
  double served_version = 0.0, served_objects = -1.0;  // as wva_server says
  const auto under_lock = [&](auto take) {
    return [&, take](const auto& sample, const dds::SampleInfo&) {
      {
        const std::lock_guard lock(mutex);
        take(sample);
      }
      changed.notify_one();
    };
  };
  dds::Reader<msg::WorkspaceVersion> versions(impl_->participant, dds::kWorkspaceVersion,
                                              under_lock([&](const msg::WorkspaceVersion& version) {
                                                listing.cell = version.cell().c_str();
                                                listing.version = version.version();
                                                listing.bricks = version.brick_count();
                                              }));
  dds::Reader<msg::WorkspaceObject> objects_reader(
      impl_->participant, dds::kWorkspaceObject, under_lock([&](const msg::WorkspaceObject& object) {
        if (object.mesh_hash() == 0) {
          objects.erase(object.id());
        } else {
          objects[object.id()] = {object.id(), object.name().c_str(), pose_of(object.X_WO())};
        }
      }));
  dds::Reader<msg::ComponentStatus> statuses(impl_->participant, dds::kComponentStatus,
                                             under_lock([&](const msg::ComponentStatus& status) {
                                               if (status.component_name() != "wva_server") return;
                                               for (const msg::Figure& figure : status.figures()) {
                                                 if (figure.name() == "version") served_version = figure.value();
                                                 if (figure.name() == "objects") served_objects = figure.value();
                                               }
                                             }));
  std::unique_lock lock(mutex);
  const bool whole = changed.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] {
    return listing.version != 0 && served_version == static_cast<double>(listing.version) &&
           served_objects == static_cast<double>(objects.size());
  });
  if (!whole) return std::nullopt;
  for (auto& [id, object] : objects) listing.objects.push_back(object);
  return listing;
}

}  // namespace phantom::wva_server
