#include "platform/system/file_descriptor.h"

#include <unistd.h>

#include <cerrno>

namespace alidade {

void FileDescriptor::reset(int number) {
  const int closed = std::exchange(number_, number);
  if (closed >= 0) {
    const int kept = errno;
    ::close(closed);
    errno = kept;
  }
}

}  // namespace alidade
