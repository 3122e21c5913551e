#include "common/runtime/process/stop_file.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/core/errors.hpp"
#include "common/core/file_sync.hpp"
#include "common/core/random.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/stop_file_image.hpp"
#include "common/runtime/process/stop_folders.hpp"

namespace phantom::runtime {
namespace {

constexpr int kMaxProcesses = 8;

std::string stem(const std::string& component, const core::NetworkOptions& network) {
  std::string name = component;
  name.append(".domain-").append(std::to_string(network.domain));
  if (!network.partition.empty()) name.append(".").append(network.partition);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '/' || c == '\0'; }, '_');
  return name;
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw core::MissingError(file.string() + ": " + what +
                           "; a stop must outlive the process: start as a user who may write there, or give "
                           "a folder with --state-dir");
}

std::string because(const char* what) { return std::string(what) + " (" + std::strerror(errno) + ")"; }

std::filesystem::path numbered(const std::filesystem::path& folder, std::string name, int process) {
  if (process > 1) name.append(".").append(std::to_string(process));
  return folder / name.append(".stop");
}

teleop::StopRecord a_stop() { return {core::random_number(), teleop::StopCause::kEmergency}; }

}  // namespace

struct StopFile::Content {
  std::array<char, 8> magic;
  std::atomic<std::uint64_t> id;
  std::atomic<std::uint32_t> cause;
  std::array<char, 12> zero;
};

StopFile::StopFile(StopPlace place, const std::string& component, const core::NetworkOptions& network)
    : place_(std::move(place)), component_(component), name_(stem(component, network)) {
  static_assert(sizeof(Content) == sizeof(StopImage) && std::atomic<std::uint64_t>::is_always_lock_free);
  content_ = static_cast<Content*>(page_.address());
  try {
    open_first_free(true);
    adopt_all();
    join_other_folders();
  } catch (...) {
    if (descriptor_ >= 0) close(descriptor_);
    throw;
  }
  if (const teleop::StopRecord kept = read(); kept.id != 0)
    add_notice(std::string("stopped since before this start (") + name_of(kept.cause) + "), until a reset");
  keeper_ = std::jthread([this](const std::stop_token& stop) {
    core::apply_thread_config(core::ThreadRole::kStopFile);
    while (!stop.stop_requested()) {
      written_.wait(kCheckPeriod_s);
      flush();
    }
  });
}

StopFile::~StopFile() {
  keeper_.request_stop();
  written_.raise();
  if (keeper_.joinable()) keeper_.join();
  if (descriptor_ >= 0) close(descriptor_);
}

void StopFile::add_notice(const std::string& sentence) {
  if (!notice_.empty()) notice_ += "; ";
  notice_ += sentence;
}

void StopFile::open_first_free(bool starting) {
  make_stop_folder(place_.folder, place_.shared);
  for (int process = 1; process <= kMaxProcesses; ++process) {
    if (!open(numbered(place_.folder, name_, process), starting)) continue;
    if (starting && process > 1)
      add_notice("another " + component_ + " of this cell runs on this host; stops are kept in " +
                 file_.string());
    return;
  }
  refuse(numbered(place_.folder, name_, 1), "held by eight processes already");
}

// Returns false if another process holds the file. Adopts the stop in the file at the start; later this
// process knows what is in force.
bool StopFile::open(const std::filesystem::path& file, bool starting) {
  int descriptor = -1;
  do {
    descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
    if (descriptor < 0 && errno == ENOENT) descriptor = create_stop_image(file);
    if (descriptor < 0 && errno != EEXIST) refuse(file, because("cannot be opened"));
    if (descriptor >= 0 && flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      close(descriptor);
      return false;
    }
    if (descriptor >= 0 && !is_same_file(descriptor, file)) {  // replaced just now
      close(descriptor);
      descriptor = -1;
    }
  } while (descriptor < 0);
  if (starting) {
    const auto kept = stop_in(descriptor);
    if (!kept) add_notice(file.string() + ": damaged; taken for an emergency stop");
    const teleop::StopRecord record = kept ? *kept : a_stop();
    cause_ = static_cast<std::uint32_t>(record.cause);
    id_ = record.id;
  }
  if (!write_stop_image(descriptor, read()) || !core::sync_folder_of(file)) {
    const int error = errno;
    close(descriptor);
    errno = error;
    refuse(file, because("cannot be written"));
  }
  take(descriptor, file);
  return true;
}

// The kernel's cache is shared, so a store through the old mapping of the same file is seen through the new.
void StopFile::take(int descriptor, const std::filesystem::path& file) {
  if (!page_.map(descriptor)) {
    const int error = errno;
    if (descriptor != descriptor_) close(descriptor);
    errno = error;
    refuse(file, because("cannot be mapped"));
  }
  if (descriptor != descriptor_ && descriptor_ >= 0) close(descriptor_);
  descriptor_ = descriptor;
  const std::lock_guard lock(text_mutex_);
  file_ = file;
}

void StopFile::adopt_all() {
  for (int process = 1; process <= kMaxProcesses; ++process) {
    adopt_from(numbered(place_.folder, name_, process), true);
    for (const auto& folder : place_.former) adopt_from(numbered(folder, name_, process), true);
  }
}

// Two folders for one side of a cell on one host: a stop in either is in force for both. Both are entered in
// the list before the other's files are looked at, so that of two processes that start at once one is
// refused.
void StopFile::join_other_folders() {
  const std::filesystem::path& host = place_.host.empty() ? place_.folder : place_.host;
  const StopFolders list(host / (name_ + ".folders"));
  if (!place_.host.empty()) {
    make_stop_folder(host, place_.host_shared);
    std::error_code problem;
    if (!std::filesystem::exists(host, problem) && !problem) return;  // so nobody can keep a stop there
    list.add(place_.folder);
  }
  std::vector<std::filesystem::path> others = list.read();
  if (!place_.host.empty()) others.push_back(host);
  for (const auto& folder : others) {
    if (folder == place_.folder) continue;
    for (int process = 1; process <= kMaxProcesses; ++process)
      adopt_from(numbered(folder, name_, process), false);
  }
}

// Adopts the stop from another process's file, and clears it there if no process holds that file any more.
void StopFile::adopt_from(const std::filesystem::path& file, bool may_be_held) {
  if (file == file_) return;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0 && (errno == ENOENT || errno == ENOTDIR)) return;
  if (descriptor < 0) refuse(file, because("cannot be read"));
  const teleop::StopRecord kept = stop_in(descriptor).value_or(a_stop());
  // Only where it matters: a process that starts now would take a lock for another process's.
  const bool is_held = (kept.id != 0 || !may_be_held) && flock(descriptor, LOCK_EX | LOCK_NB) != 0;
  if (is_held && !may_be_held) {
    close(descriptor);
    refuse(file, "held by another " + component_ +
                     " of this cell, which would not know the stops of this one; start both alike");
  }
  if (kept.id != 0 && read().id == 0) write(kept);
  if (kept.id != 0 && !is_held) {
    flush();  // it is on the disk here before it goes there
    write_stop_image(descriptor, {});
  }
  close(descriptor);
}

teleop::StopRecord StopFile::read() const noexcept {
  const std::uint64_t id = id_.load(std::memory_order_acquire);
  if (id == 0) return {};
  return {id, static_cast<teleop::StopCause>(cause_.load(std::memory_order_relaxed))};
}

void StopFile::store(const teleop::StopRecord& record) noexcept {
  if (record.id != 0)
    content_->cause.store(static_cast<std::uint32_t>(record.cause), std::memory_order_relaxed);
  content_->id.store(record.id, std::memory_order_release);
}

void StopFile::write(const teleop::StopRecord& record) noexcept {
  writes_.fetch_add(1);
  if (record.id != 0) cause_.store(static_cast<std::uint32_t>(record.cause), std::memory_order_relaxed);
  id_.store(record.id, std::memory_order_release);
  store(record);
  writes_.fetch_add(1);
  written_.raise();
}

std::filesystem::path StopFile::file() const {
  const std::lock_guard lock(text_mutex_);
  return file_;
}

std::string StopFile::trouble() const {
  const std::lock_guard lock(text_mutex_);
  return trouble_;
}

void StopFile::set_trouble(const std::string& text) {
  const std::lock_guard lock(text_mutex_);
  trouble_ = text;
}

// Returns what is wrong with the file; empty if it keeps the stop in force.
std::string StopFile::fault() const {
  if (!is_same_file(descriptor_, file_)) return "removed or replaced while in use";
  for (;;) {  // until no write() came between
    const std::uint32_t before = writes_.load();
    const teleop::StopRecord now = read();
    const auto kept = stop_in(descriptor_);
    const bool lost = page_.lost();
    if (before % 2 != 0 || before != writes_.load()) continue;
    if (lost || !has_image_size(descriptor_)) return "cut short or extended while in use";
    return kept == now ? "" : "altered while in use";
  }
}

// Writes the stop in force into the file, or into a new one at its place.
void StopFile::restore(bool in_place) {
  if (in_place) {
    if (!write_stop_image(descriptor_, read())) refuse(file_, because("cannot be written"));
    take(descriptor_, file_);
  } else {
    open_first_free(false);
  }
  for (std::uint32_t before = 0;
       before % 2 != 0 || before != writes_.load();) {  // a stop that came meanwhile
    before = writes_.load();
    store(read());
  }
}

void StopFile::check() {
  const std::string found = fault();
  if (found.empty()) return;
  synced_ = false;
  const std::string where = file_.string();
  restore(is_same_file(descriptor_, file_));
  spdlog::error("{}: {}; the stop in force is kept in {} again", where, found, file_.string());
}

void StopFile::flush() noexcept {
  const std::lock_guard lock(mutex_);
  try {
    check();
    set_trouble("");
  } catch (const std::exception& problem) {
    const std::string trouble = std::string("THE STOP CANNOT BE KEPT: ") + problem.what();
    set_trouble(trouble);
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (logged_ns_ == 0 || core::seconds(now_ns - logged_ns_) > kLogPeriod_s) {
      spdlog::error("{}", trouble);
      logged_ns_ = now_ns;
    }
  }
  const teleop::StopId now = read().id;
  if (synced_ && now == flushed_) return;
  synced_ = fdatasync(descriptor_) == 0;
  flushed_ = now;
}

}  // namespace phantom::runtime
