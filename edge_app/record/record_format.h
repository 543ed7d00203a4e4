#pragma once
// An OrientationRecord as a line of JSON or CSV. Both have the same names, order and digits.
//
// Doubles are printed with the fewest digits that read back to the same value. A field without a
// value is null in JSON and empty in CSV. Arrays become columns in CSV:
// q_base_from_camera -> q_x,q_y,q_z,q_w; orientation_sigma_rad -> orientation_sigma_rad_0,_1,_2;
// orientation_covariance_rad2, row by row -> orientation_covariance_rad2_0 to _8.
// Allocates, so it is for the output thread.

#include <string>

#include "edge_app/record/orientation_record.h"

namespace alidade {

enum class OutputFormat { kJson, kCsv };

// These end with a line feed.
std::string json_line(const OrientationRecord& record);
std::string csv_header();
std::string csv_line(const OrientationRecord& record);

}  // namespace alidade
