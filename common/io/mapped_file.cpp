#include "common/io/mapped_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/base/error.hpp"

namespace palpate {

MappedFile::MappedFile(const std::filesystem::path& file) {
  const auto refuse = [&](const char* why) { throw InputError(file.string(), std::string("cannot be read: ") + why, "a file"); };
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe is refused, not waited for
  if (descriptor < 0) refuse(std::strerror(errno));
  struct stat about {};
  const bool regular = ::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode);
  void* mapped = nullptr;
  if (regular && about.st_size > 0) {
    size_ = static_cast<std::size_t>(about.st_size);
    mapped = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
  }
  const int fault = errno;
  ::close(descriptor);
  if (!regular) refuse("it is no regular file");
  if (mapped == MAP_FAILED) refuse(std::strerror(fault));
  data_ = static_cast<const std::byte*>(mapped);
}

MappedFile::~MappedFile() {
  if (data_) ::munmap(const_cast<std::byte*>(data_), size_);
}

}  // namespace palpate
