# A text file as a C++ constant: -DIN=file -DOUT=header -DNAMESPACE=namespace -DNAME=constant
file(READ ${IN} text)
file(WRITE ${OUT} "#pragma once\nnamespace ${NAMESPACE} {\ninline constexpr char ${NAME}[] = R\"EMBED(${text})EMBED\";\n}\n")
