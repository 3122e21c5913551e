#pragma once

#include <atomic>
#include <cstddef>

namespace phantom::runtime {

/// A page of memory that maps a file and that stays usable if the file is cut short: a store beyond the
/// file's end goes to memory of the process instead of ending it by SIGBUS. lost() reports that it happened.
class GuardedPage {
 public:
  static constexpr std::size_t kMax = 16;  ///< that live at a time in one process

  /// Reserves one page of zeros, which maps no file yet. Throws std::bad_alloc if there is no memory, or if
  /// kMax live already. The first one installs a handler of SIGBUS, which forwards what is not of a page.
  GuardedPage();
  ~GuardedPage();
  GuardedPage(const GuardedPage&) = delete;
  GuardedPage& operator=(const GuardedPage&) = delete;

  /// Maps the first page of the file there instead, shared and writable. A concurrent store goes to the old
  /// or to the new mapping. Returns whether it could; errno says why not.
  bool map(int descriptor) noexcept;
  void* address() const noexcept { return address_; }
  /// Returns whether a store went to memory instead of the file, since the last map(). Real-time safe: yes.
  bool lost() const noexcept;

 private:
  void* address_ = nullptr;
  std::size_t slot_ = 0;
};

}  // namespace phantom::runtime
