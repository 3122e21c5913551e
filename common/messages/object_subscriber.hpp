#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/object_sources.hpp"

namespace phantom::messages {

/// Reads workspace_object and workspace_version, and tells what becomes different of the objects in force and
/// what arms carry. Which server's count is ObjectSources' rule: a successor's count once the one before has
/// gone, also those that it sent meanwhile.
class ObjectSubscriber {
 public:
  /// Called on the middleware's threads, one call at a time. `carried`: all that arms carry now.
  using OnChange = std::function<void(const std::vector<WorkspaceObject>& changes,
                                      const std::vector<CarriedObject>& carried)>;

  /// What `on_change` uses must outlive this. Throws dds::DdsError.
  ObjectSubscriber(dds::Participant& participant, OnChange on_change)
      : on_change_(std::move(on_change)),
        objects_(participant, dds::kWorkspaceObject,
                 [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
                   auto object = from_idl(message);
                   if (!object) return false;
                   const std::lock_guard lock(mutex_);
                   return pass(sources_.take(info.writer, *object));
                 }),
        versions_(
            participant, dds::kWorkspaceVersion,
            [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
              auto version = from_idl(message);
              if (!version) return false;
              const std::lock_guard lock(mutex_);
              pass(sources_.commit(info.writer, *std::move(version)));
              return true;
            },
            [this](const dds::GuidPrefix& server) {
              const std::lock_guard lock(mutex_);
              pass({true, sources_.gone(server)});
            }) {}

 private:
  bool pass(const ObjectSources::Taken& taken) {
    on_change_(taken.changes, sources_.carried());
    return taken.accepted;
  }

  OnChange on_change_;
  std::mutex mutex_;
  ObjectSources sources_;  // guarded by mutex_
  // Last: their callbacks use the others.
  dds::Reader<msg::WorkspaceObject> objects_;
  dds::Reader<msg::WorkspaceVersion> versions_;
};

}  // namespace phantom::messages
