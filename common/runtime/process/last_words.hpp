#pragma once

#include <string>

namespace phantom::runtime {

/// Makes the process tell on standard error why it dies. Before std::terminate ends it: which thread, and the
/// type and words of the exception that nobody caught. Before SIGABRT, SIGSEGV, SIGBUS, SIGFPE or SIGILL ends
/// it: which thread, and the addresses of the calls that led there, as FILE(+OFFSET), which addr2line turns
/// into lines of source. It still ends by that signal. If telling takes longer than 2 s, it ends by SIGALRM:
/// nobody reads, say. In builds with a sanitizer, that tells of the signals instead, except of SIGABRT.
/// `component`: the name before the words. Call it once in a process, before it starts threads.
void leave_last_words(const std::string& component);

}  // namespace phantom::runtime
