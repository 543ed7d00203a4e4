#pragma once
// RecordSinks: gives each record to several sinks, one after the other. If one sink ends, all end.

#include <vector>

#include "edge_app/record/orientation_record.h"

namespace alidade {

class RecordSinks final : public RecordSink {
 public:
  // Must be called before the first record. The sink must outlive this object.
  void add(RecordSink* sink) { sinks_.push_back(sink); }

  [[nodiscard]] bool write(const OrientationRecord& record) override {
    for (RecordSink* sink : sinks_) {
      if (!sink->write(record)) {
        ended_ = sink;
        return false;
      }
    }
    return true;
  }
  void interrupt() override {
    for (RecordSink* sink : sinks_) sink->interrupt();
  }
  [[nodiscard]] std::string error() const override {
    return ended_ == nullptr ? "" : ended_->error();
  }

 private:
  std::vector<RecordSink*> sinks_;
  RecordSink* ended_ = nullptr;
};

}  // namespace alidade
