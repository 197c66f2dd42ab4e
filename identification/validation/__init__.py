"""Does the calibrated model hold on recordings it has not seen (section 7)?"""
