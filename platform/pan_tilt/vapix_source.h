#pragma once
// VapixSource: polls an Axis camera for its pan, tilt and zoom:
//   GET /axis-cgi/com/ptz.cgi?query=position[&camera=N]
// over one kept HTTP connection with digest authentication (one 401 in total, not one a poll).
//
// Samples are polled on a fixed grid of 1/rate_hz; a late answer skips grid points and does not
// shift the grid. The answer was true between earliest_time_s, just before the request was sent,
// and latest_time_s, when the answer's first bytes were here. A server that writes header and body
// in two pieces may hold the second back for the 40 ms of a delayed acknowledgement: that limits
// the rate, not the interval. kDisconnected: unreachable, timed out, HTTP status other than 200, an
// `Error:` answer, an answer that is not a position. kFailed: wrong user or password (401),
// unusable URL. read() runs the transfer on the calling thread; it allocates.

#include <memory>
#include <string>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct VapixSourceOptions {
  std::string url;   // http://host[:port] or https://...
  std::string user;  // these go before what the URL may hold
  std::string password;
  int camera = 0;  // video channel of a device with several, 1, 2, ...; 0: not named in the request
  double rate_hz = 30;
  double timeout_s = 1;      // for one poll
  double max_backoff_s = 5;  // longest pause between two tries
};

class VapixSource : public PanTiltSource {
 public:
  explicit VapixSource(const VapixSourceOptions& options);
  ~VapixSource() override;
  VapixSource(const VapixSource&) = delete;
  VapixSource& operator=(const VapixSource&) = delete;

  [[nodiscard]] ReadStatus read(PanTiltSample& sample, double timeout_s) override;
  void stop() override;
  [[nodiscard]] std::string error() const override;
  [[nodiscard]] std::string name() const override;

 private:
  class Implementation;  // keeps libcurl out of this header
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace alidade
