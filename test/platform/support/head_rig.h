#pragma once
// HeadRig: a simulated head on its line, and sources that ask it, of each kind of head_kinds.h.

#include <memory>

#include "platform/pan_tilt/query_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/head_kinds.h"

namespace alidade {

class HeadRig {
 public:
  explicit HeadRig(
      const HeadKind& kind,
      std::function<HeadPosition()> position = [] { return kPositionOfHeads; })
      : kind_(kind),
        server_(
            std::make_unique<HeadServer>(kind.link, simulated_head(kind, std::move(position)))) {}

  // Times out so slowly that a busy machine is no fault, asks as fast as the line can.
  [[nodiscard]] QuerySourceOptions options() const {
    QuerySourceOptions options;
    options.link = {server_->address(), 115200};
    options.rate_hz = 1000;
    options.timeout_s = 4 * kDeadline_s;
    options.max_backoff_s = 0.01;
    options.pan = pan_axis_of(kind_);
    options.tilt = tilt_axis_of(kind_);
    return options;
  }
  [[nodiscard]] std::unique_ptr<QueryProtocol> protocol() const {
    return make_protocol(kind_.head->options);
  }
  [[nodiscard]] std::unique_ptr<QuerySource> open() const { return open(options()); }
  [[nodiscard]] std::unique_ptr<QuerySource> open(const QuerySourceOptions& options) const {
    return std::make_unique<QuerySource>(protocol(), options);
  }

  // A position as far from the true one as rounding to steps allows; degrees.
  [[nodiscard]] double step_deg() const { return kind_.head->step_deg; }

  HeadServer& server() { return *server_; }

 private:
  HeadKind kind_;
  std::unique_ptr<HeadServer> server_;
};

}  // namespace alidade
