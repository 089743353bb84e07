#include "tests/support/realtime_guard.hpp"

#include <dlfcn.h>
#include <pthread.h>

#include <cerrno>
#include <cstdlib>
#include <typeinfo>

namespace palpate::test {

namespace {

// Plain thread-local data of the program itself: reading it never allocates.
thread_local bool watched = false;
thread_local RealtimeFaults faults;

void note(std::uint64_t RealtimeFaults::*what) {
  if (watched) ++(faults.*what);
}

}  // namespace

RealtimeGuard::RealtimeGuard() {
  faults = {};
  watched = true;
}
RealtimeGuard::~RealtimeGuard() { watched = false; }
RealtimeFaults RealtimeGuard::end() {
  watched = false;
  return faults;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
bool RealtimeGuard::active() { return false; }
#else
bool RealtimeGuard::active() { return true; }
#endif

void note_allocation() { note(&RealtimeFaults::allocations); }
void note_free() { note(&RealtimeFaults::frees); }
void note_lock() { note(&RealtimeFaults::locks); }
void note_throw() { note(&RealtimeFaults::throws); }

}  // namespace palpate::test

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// The C library's own entry points behind the public names.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) noexcept {
  palpate::test::note_allocation();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  palpate::test::note_allocation();
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  palpate::test::note_allocation();
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  palpate::test::note_allocation();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  palpate::test::note_allocation();
  *out = __libc_memalign(alignment, size);
  return *out ? 0 : ENOMEM;
}
void free(void* memory) noexcept {
  if (memory) palpate::test::note_free();
  __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static Lock next = nullptr;  // not initialised by a call, which would lock
  if (!next) next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  palpate::test::note_lock();
  return next(mutex);
}

[[noreturn]] void __cxa_throw(void* thrown, std::type_info* type, void (*destroy)(void*)) {
  using Throw = void (*)(void*, std::type_info*, void (*)(void*));
  static Throw next = nullptr;
  if (!next) next = reinterpret_cast<Throw>(dlsym(RTLD_NEXT, "__cxa_throw"));
  palpate::test::note_throw();
  next(thrown, type, destroy);
  std::abort();
}
}

#endif
