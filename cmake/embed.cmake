file(READ ${IN} text)
file(WRITE ${OUT} "#pragma once\nnamespace palpate::schema {\ninline constexpr char kSceneFbs[] = R\"FBS(${text})FBS\";\n}\n")
