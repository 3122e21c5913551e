#include "common/workspace/workspace_sources.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace phantom::workspace {
namespace {

core::Status too_many() {
  return {core::ErrorCode::kResourceExhausted,
          "more than " + std::to_string(WorkspaceSources::kMax) +
              " processes send a workspace; allowed: one, and its successor"};
}

}  // namespace

WorkspaceSources::Source* WorkspaceSources::find(const SourceId& id) {
  const auto found =
      std::find_if(sources_.begin(), sources_.end(), [&](const auto& source) { return source->id == id; });
  return found != sources_.end() ? found->get() : nullptr;
}

WorkspaceSources::Source* WorkspaceSources::find_or_add(const SourceId& id) {
  Source* source = find(id);
  if (source == nullptr && sources_.size() < kMax) {
    sources_.push_back(std::make_unique<Source>(Source{.id = id}));
    source = sources_.back().get();
  }
  if (source == nullptr) return nullptr;
  source->gone = false;
  arrange();
  return source;
}

/// Has those beside the one in force build their workspaces if that has gone, and only then.
void WorkspaceSources::arrange() {
  for (const auto& source : sources_) {
    if (source.get() != in_force_) source->assembler.keep_packed(attended());
  }
}

core::Status WorkspaceSources::put_brick(const SourceId& id, BrickKey key, std::uint64_t version,
                                         std::span<const std::uint8_t> bytes) {
  Source* source = find_or_add(id);
  if (source == nullptr) return too_many();
  allow(*source);
  const core::Status status = source->assembler.put_brick(key, version, bytes);
  if (status.code() == core::ErrorCode::kResourceExhausted && attended() && source != in_force_) {
    gone(id);
  } else {
    choose();
  }
  return status;
}

core::Status WorkspaceSources::commit(const SourceId& id, const VersionDescription& description) {
  Source* source = find_or_add(id);
  if (source == nullptr) return too_many();
  const std::string named = "workspace version " + std::to_string(description.version);
  if (description.version == 0) return core::Status::invalid_argument(named + "; allowed: 1 or more");
  if (description.version < source->version) {
    return core::Status::invalid_argument(named + ": came after version " + std::to_string(source->version) +
                                          "; allowed: rising versions");
  }
  if (description.version == source->version && description.content_hash != source->content_hash)
    return core::Status::invalid_argument(named + ": came before with other content");
  const core::Status status = source->assembler.commit(description);
  if (status) {
    source->version = description.version;
    source->content_hash = description.content_hash;
    choose();
  }
  return status;
}

/// Sets how much memory a source may take.
void WorkspaceSources::allow(Source& source) const {
  const bool beside = attended() && in_force_ != &source;
  source.assembler.allow(
      most_bytes_,
      beside ? std::max(kMinReceivedBytes, 2 * in_force_->assembler.received_bytes()) : SIZE_MAX);
}

void WorkspaceSources::gone(const SourceId& id) {
  Source* source = find(id);
  if (source == nullptr) return;
  source->gone = true;
  if (source != in_force_)
    std::erase_if(sources_, [source](const auto& each) { return each.get() == source; });
  choose();
}

void WorkspaceSources::choose() {
  if (attended()) return;
  arrange();
  const auto whole = std::find_if(sources_.begin(), sources_.end(), [](const auto& source) {
    return !source->gone && source->assembler.current();
  });
  if (whole == sources_.end()) return;
  const Source* before = std::exchange(in_force_, whole->get());
  std::erase_if(sources_, [before](const auto& each) { return each.get() == before; });
  arrange();
}

void WorkspaceSources::prepare() {
  if (in_force_ != nullptr) in_force_->assembler.prepare();
}

const std::shared_ptr<const Workspace>& WorkspaceSources::current() const {
  static const std::shared_ptr<const Workspace> none;
  return in_force_ != nullptr ? in_force_->assembler.current() : none;
}

double WorkspaceSources::greatest_neighbour_mu() const {
  return in_force_ != nullptr ? in_force_->assembler.greatest_neighbour_mu() : 0.0;
}

std::uint64_t WorkspaceSources::announced() const {
  if (in_force_ != nullptr && !in_force_->gone) return in_force_->version;
  for (const auto& source : sources_) {
    if (!source->gone && source->version != 0) return source->version;
  }
  return in_force_ != nullptr ? in_force_->version : 0;
}

std::optional<SourceId> WorkspaceSources::in_force() const {
  return in_force_ != nullptr ? std::optional(in_force_->id) : std::nullopt;
}

bool WorkspaceSources::contested() const {
  return std::count_if(sources_.begin(), sources_.end(), [](const auto& source) { return !source->gone; }) >
         1;
}

}  // namespace phantom::workspace
